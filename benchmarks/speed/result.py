"""What a benchmark reports: claims with their targets, tables, and sentences."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field


@dataclass(frozen=True)
class Claim:
    """A quantity with its target.

    text      what is measured
    result    the number; None where it was not measured, and `note` says why
    target    the number to reach; None for a quantity without one
    unit      "times", "s", "%", ...
    at_least  whether the result has to be at least the target, otherwise at most
    note      what the number does not say by itself
    """

    text: str
    result: float | None
    target: float | None
    unit: str = "times"
    at_least: bool = True
    note: str = ""

    @property
    def met(self) -> bool | None:
        """Whether the target is reached; None where there is no target or no result."""
        if self.result is None or self.target is None:
            return None
        return self.result >= self.target if self.at_least else self.result <= self.target


@dataclass(frozen=True)
class Table:
    """Rows of texts and numbers under a caption."""

    caption: str
    columns: list[str]
    rows: list[list]


@dataclass(frozen=True)
class Chart:
    """A bar for each label, of which a part, 0 to its value, is drawn in another colour; `file` is
    its name in the folder of the page's figures."""

    file: str
    title: str
    labels: list[str]
    values: list[float]
    parts: list[float]
    axis: str


@dataclass(frozen=True)
class Result:
    """One benchmark.

    point    number of the claim's group, the order on the page
    title    heading
    what     sentences: what is compared with what
    claims, tables
    bound    sentences: what limits the time, and how far from it we are
    notes    sentences: what was left out
    charts   figures of its own
    """

    point: int
    title: str
    what: list[str]
    claims: list[Claim]
    tables: list[Table] = field(default_factory=list)
    bound: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    charts: list[Chart] = field(default_factory=list)

    def to_json(self) -> dict:
        return asdict(self)

    @classmethod
    def from_json(cls, content: dict) -> Result:
        return cls(
            **content
            | {
                "claims": [Claim(**claim) for claim in content["claims"]],
                "tables": [Table(**table) for table in content["tables"]],
                "charts": [Chart(**chart) for chart in content.get("charts", ())],
            }
        )
