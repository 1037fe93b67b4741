"""Rates over all cases, each with its interval, beside what was to be reached."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.stats import binomtest

from rippletwin.explanation.thresholds import ACCEPT

CHANGES = (0.0, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, np.inf)
NEAR_FLOOR = 1.2
PROBABILITIES = (0.0, 0.5, 0.8, 0.95, 0.99, 1.0)


@dataclass(frozen=True)
class Rate:
    """`hits` of `count`, with the exact 95 % interval of the share."""

    hits: int
    count: int

    @property
    def share(self) -> float:
        return self.hits / self.count if self.count else float("nan")

    @property
    def interval(self) -> tuple[float, float]:
        """95 %, Clopper and Pearson, Biometrika 26, 1934; (0, 1) of nothing."""
        if not self.count:
            return 0.0, 1.0
        low, high = binomtest(self.hits, self.count).proportion_ci()
        return float(low), float(high)

    def __str__(self) -> str:
        if not self.count:
            return "no case"
        low, high = self.interval
        return f"{self.share:.0%} ({self.hits} of {self.count}; {low:.0%} to {high:.0%})"


def rate(values: Iterable[bool]) -> Rate:
    """Rate of what is true."""
    values = list(values)
    return Rate(sum(map(bool, values)), len(values))


def scores(rows: list[dict]) -> list[tuple[str, str, Rate]]:
    """(what, target, rate) of each score of the tool."""

    def of(*kinds: str, where: Callable[[dict], bool] = lambda row: True) -> list[dict]:
        return [row for row in rows if row["kind"] in kinds and where(row)]

    def plain(row: dict) -> bool:
        return row["plain"]

    singles, pairs = of("single", where=plain), of("pair")
    twins, outside = of("indistinguishable"), of("outside")
    loud = of("outside", where=plain)
    placed = {
        n: [p for row in of("single", where=plain) if row["sensors"] == n for p in row["in_place"]]
        for n in (2, 3)
    }
    deviations = [b["z"] for row in rows for b in row["bias"]["corrected"]]
    return [
        ("False alarms, nominal values within tolerance", "at most 2 %", _alarms(of("none"))),
        ("False alarms, nominal values 2 to 3 deviations off", "at most 2 %", _alarms(of("off"))),
        ("Plain single effects: alarm", "", _alarms(singles)),
        (
            "Plain single effects: right effect or class named",
            "at least 90 %",
            rate(row["right"] for row in singles),
        ),
        (
            "... and nothing wrong beside it",
            "",
            rate(row["right"] and row["clean"] for row in singles),
        ),
        (
            f"Of these, worth {ACCEPT:.0f} of log evidence to one who knows: right effect",
            "at least 90 %",
            rate(row["right"] for row in singles if held(row)),
        ),
        ("Rightly named, two sensors: right place", "at least 75 %", rate(placed[2])),
        ("Rightly named, three sensors: right place", "at least 95 %", rate(placed[3])),
        ("All single effects: right effect", "", rate(row["right"] for row in of("single"))),
        (
            "Pairs: at least one right, none wrong",
            "at least 85 %",
            rate(row["found"] > 0 and row["clean"] for row in pairs),
        ),
        ("Pairs: both right", "at least 65 %", rate(row["found"] == 2 for row in pairs)),
        (
            "Plain effects outside the library: unexplained",
            "at least 90 %",
            rate(row["verdict"] == "unexplained" for row in loud),
        ),
        (
            "All effects outside the library: misnamed",
            "at most 5 %",
            rate(bool(row["said"]) for row in outside),
        ),
        (
            "Declared indistinguishable: class or right name",
            "",
            rate(row["right"] and row["clean"] for row in twins),
        ),
        (
            "95 % intervals that hold the true value",
            "92 to 97 %",
            rate(i for row in rows for i in row["intervals"]),
        ),
        (
            "Rightly named: held-out misfit within 1.2 times the floor",
            "",
            rate(
                row["held_out_after"] <= NEAR_FLOOR * row["floor"]
                for row in rows
                if row["right"] and row["clean"]
            ),
        ),
        (
            "Delays and impedances within two deviations, corrected",
            "at least 95 %",
            rate(abs(z) < 2 for z in deviations),
        ),
    ]


def held(row: dict) -> bool:
    """Whether the data hold the effect, as far as `concealed.oracle` can tell."""
    return row["worth"] is None or row["worth"] >= ACCEPT


def _alarms(rows: list[dict]) -> Rate:
    return rate(row["alarm"] for row in rows)


def compared(rows: list[dict]) -> list[tuple[str, Rate, Rate, Rate]]:
    """(method, false alarms, right effect in plain single cases, misnamed outside the library)."""
    free = [row for row in rows if row["kind"] in ("none", "off")]
    singles = [row for row in rows if row["kind"] == "single" and row["plain"]]
    outside = [row for row in rows if row["kind"] == "outside"]
    table = [
        (
            "rippletwin explain",
            _alarms(free),
            rate(row["right"] for row in singles),
            rate(bool(row["said"]) for row in outside),
        )
    ]
    for name, title in (
        ("recalibrate", "recalibrate only"),
        ("bic", "BIC pick"),
        ("sparse", "sparse regression on the residual"),
    ):
        table.append(
            (
                title,
                rate(row["baselines"][name]["alarm"] for row in free),
                rate(row["baselines"][name]["right"] for row in singles),
                rate(bool(row["baselines"][name]["said"]) for row in outside),
            )
        )
    return table


def power(rows: list[dict]) -> list[tuple[float, float, Rate, Rate]]:
    """(from, to, alarm, right effect) of single effects by the change that they make."""
    singles = [row for row in rows if row["kind"] in ("single", "indistinguishable")]
    return [
        (
            low,
            high,
            _alarms(inside),
            rate(row["right"] for row in inside),
        )
        for low, high in pairwise(CHANGES)
        if (inside := [row for row in singles if low <= row["change"] < high])
    ]


def reliability(rows: list[dict]) -> list[tuple[float, float, float, Rate]]:
    """(from, to, mean stated probability, right) of the named effects."""
    stated = [pair for row in rows for pair in row["stated"]]
    table = []
    for low, high in pairwise(PROBABILITIES):
        last = high == 1.0
        inside = [(p, right) for p, right in stated if low <= p < high or (last and p == 1.0)]
        if inside:
            mean = float(np.mean([p for p, _ in inside]))
            table.append((low, high, mean, rate(right for _, right in inside)))
    return table


def brier(rows: list[dict]) -> float:
    """Mean square of stated probability less outcome (Brier, Mon. Weather Rev. 78, 1950)."""
    stated = [pair for row in rows for pair in row["stated"]]
    return float(np.mean([(p - right) ** 2 for p, right in stated])) if stated else float("nan")


def biases(rows: list[dict]) -> list[tuple[str, str, float, float, Rate]]:
    """(quantity, which, mean relative error, its rms, within two deviations), with an effect."""
    table = []
    for quantity in ("delay", "impedance"):
        for which in ("calibrated", "corrected"):
            found = [
                b
                for row in rows
                if row["effects"]
                for b in row["bias"][which]
                if b["quantity"] == quantity
            ]
            if found:
                errors = np.array([b["relative"] for b in found])
                within = rate(abs(b["z"]) < 2 for b in found)
                rms = float(np.sqrt(np.mean(errors**2)))
                table.append((quantity, which, float(errors.mean()), rms, within))
    return table


def failed(row: dict) -> str | None:
    """In what a case falls short, in words; None where it does not."""
    kind = row["kind"]
    if kind in ("none", "off"):
        return "false alarm" if row["alarm"] else None
    if kind == "outside":
        if row["said"]:
            return "misnamed"
        return "not noticed" if row["plain"] and not row["alarm"] else None
    if row["wrong"]:
        return "wrong name" if not row["found"] else "a wrong name beside a right one"
    if kind == "pair":
        return None if row["found"] == 2 else f"{row['found']} of 2 found"
    if not row["right"]:
        return ("not noticed" if not row["alarm"] else "not named") if row["plain"] else None
    return None if all(row["in_place"]) else "wrong place"
