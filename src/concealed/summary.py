"""Shares and errors over all cases, each share with its confidence interval."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from rippletwin.explanation.thresholds import MIN_LOG_BAYES_FACTOR
from rippletwin.learning.recording_accuracy import exact_interval

CHANGE_EDGES = (0.0, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, np.inf)
PROBABILITY_EDGES = (0.0, 0.5, 0.8, 0.95, 0.99, 1.0)
LARGE_CHANGE = 0.1  # of the ripple, relative
TRUTH_FACTOR = 1.2
"""A held-out misfit up to so many times that of the fit begun from the truth is as good."""
FIFTH = 0.2
"""Share of the calibrated line's held-out misfit that may be left beside unlisted physics."""


@dataclass(frozen=True)
class Rate:
    """`hits` of `count` cases, with the exact 95 % confidence interval of the share."""

    hits: int
    count: int

    @property
    def share(self) -> float:
        return self.hits / self.count if self.count else float("nan")

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval of Clopper and Pearson, Biometrika 26, 1934; (0, 1) without a case."""
        return exact_interval(self.hits, self.count) if self.count else (0.0, 1.0)

    def __str__(self) -> str:
        if not self.count:
            return "no case"
        low, high = map(percent, self.interval)
        return f"{percent(self.share)} % ({low} to {high} %), {self.hits} of {self.count}"


def percent(share: float) -> str:
    """A share as a number of per cent, with one decimal unless that is 0.

    Without the decimal 97.6 % would reach a target of 98 %.
    """
    return f"{100 * share:.1f}".removesuffix(".0")


def rate_of(outcomes: Iterable[bool]) -> Rate:
    """Rate of the true outcomes."""
    outcomes = list(outcomes)
    return Rate(sum(map(bool, outcomes)), len(outcomes))


class Score(NamedTuple):
    """One line of the main table; `target` is text, empty where none was set."""

    what: str
    target: str
    rate: Rate


def score_table(rows: list[dict]) -> list[Score]:
    """The main table over the rows of `concealed.score.score_case`."""

    def cases(*kinds: str, where: Callable[[dict], bool] = lambda row: True) -> list[dict]:
        return [row for row in rows if row["kind"] in kinds and where(row)]

    def plain(row: dict) -> bool:
        return row["plain"]

    def places_right(sensors: int) -> Rate:
        return rate_of(
            right for row in singles if row["sensors"] == sensors for right in row["places_right"]
        )

    singles, pairs = cases("single", where=plain), cases("pair")
    outside = cases("outside")
    unlisted = cases("outside", where=plain)
    compared = [row for row in rows if row["oracle_held_out"] is not None]
    deviations = [error["z"] for row in rows for error in row["line_errors"]["corrected"]]
    large = cases("single", where=lambda row: row["change"] >= LARGE_CHANGE)
    return [
        Score("Established effects: truly there", "at least 97 %",
              rate_of(there for row in rows for there in row["established"])),
        Score("No effect, nominal values within tolerance: established, not there", "at most 2 %",
              rate_of(bool(row["wrong"]) for row in cases("none"))),
        Score("No effect, nominal values 2 to 3 standard deviations off: established, not there",
              "at most 2 %", rate_of(bool(row["wrong"]) for row in cases("off"))),
        Score("Plain single effects: alarm", "", _alarms(singles)),
        Score("Plain single effects: effect or its class named", "at least 90 %",
              rate_of(row["right"] for row in singles)),
        Score("Plain single effects: the same, and no wrong name beside it", "at least 90 %",
              rate_of(row["right"] and not row["wrong"] for row in singles)),
        Score("Plain single effects that the data support: effect or its class named",
              "at least 90 %",
              rate_of(row["right"] for row in singles if data_support_effects(row))),
        Score("Single effects that change the ripple by 10 % or more: effect or its class named",
              "at least 90 %", rate_of(row["right"] for row in large)),
        Score("Single effects that change the ripple by 10 % or more: effect or its class named "
              "first", "at least 90 %", rate_of(row["named_first"] for row in large)),
        Score("Plain single effects rightly named, two sensors: right place", "at least 80 %",
              places_right(2)),
        Score("Plain single effects rightly named, three sensors: right place", "at least 95 %",
              places_right(3)),
        Score("All single effects, also invisible ones: effect or its class named", "",
              rate_of(row["right"] for row in cases("single"))),
        Score("Pairs: at least one effect named, no wrong name", "at least 85 %",
              rate_of(row["effects_found"] > 0 and not row["wrong"] for row in pairs)),
        Score("Pairs: both effects named", "at least 70 %",
              rate_of(row["effects_found"] == 2 for row in pairs)),
        Score("Effects outside the library: established, not there", "at most 5 %",
              rate_of(bool(row["wrong"]) for row in outside)),
        Score("Plain effects outside the library that have a place: what remains is there",
              "at least 85 %",
              rate_of(right for row in unlisted for right in row["remainder_right"])),
        Score("Plain effects outside the library: held-out misfit at most a fifth of calibration's",
              "at least 80 %",
              rate_of(row["held_out_corrected"] <= FIFTH * row["held_out_calibrated"]
                      for row in unlisted)),
        Score("Effects declared indistinguishable: class or effect named, no wrong name", "",
              rate_of(row["right"] and not row["wrong"] for row in cases("indistinguishable"))),
        Score("95 % intervals of rightly named effects: true value inside", "92 to 97 %",
              rate_of(inside for row in rows for inside in row["intervals_hold"])),
        Score("Held-out misfit at most 1.2 times that of the fit begun from the truth", "all",
              rate_of(predicts_like_truth(row) for row in compared)),
        Score("Held-out misfit smaller than calibration's", "all",
              rate_of(row["held_out_corrected"] < row["held_out_calibrated"] for row in rows)),
        Score("Delays and impedances, corrected: within two stated standard deviations",
              "at least 95 %", rate_of(abs(z) < 2 for z in deviations)),
    ]  # fmt: skip


def data_support_effects(row: dict) -> bool:
    """Whether the oracle's log evidence reaches the tool's threshold, or the oracle has none."""
    return row["oracle_log_evidence"] is None or row["oracle_log_evidence"] >= MIN_LOG_BAYES_FACTOR


def predicts_like_truth(row: dict) -> bool:
    """Whether the corrected twin predicts held-out data as well as the fit begun from the truth,
    which the row must have."""
    return row["held_out_corrected"] <= TRUTH_FACTOR * row["oracle_held_out"]


def _alarms(rows: Iterable[dict]) -> Rate:
    return rate_of(row["alarm"] for row in rows)


class MethodScore(NamedTuple):
    """False alarms, plain single effects rightly named, effects outside the library named."""

    method: str
    false_alarms: Rate
    right: Rate
    misnamed: Rate


def method_table(rows: list[dict]) -> list[MethodScore]:
    """The tool beside the simpler methods."""
    free = [row for row in rows if row["kind"] in ("none", "off")]
    singles = [row for row in rows if row["kind"] == "single" and row["plain"]]
    outside = [row for row in rows if row["kind"] == "outside"]

    def scored(method: str, result: Callable[[dict], dict]) -> MethodScore:
        return MethodScore(
            method,
            rate_of(result(row)["alarm"] for row in free),
            rate_of(result(row)["right"] for row in singles),
            rate_of(bool(result(row)["named"]) for row in outside),
        )

    return [
        # Nuisance physics that is there may be named: what is not there counts.
        scored(
            "`rippletwin explain`",
            lambda row: row | {"alarm": bool(row["wrong"]), "named": row["wrong"]},
        ),
        scored("calibration alone", lambda row: row["baselines"]["recalibrate"]),
        scored("least BIC of single effects", lambda row: row["baselines"]["bic"]),
        scored("matching pursuit on the residual", lambda row: row["baselines"]["sparse"]),
    ]


class SupportScore(NamedTuple):
    """Scores where effects of these levels count as named."""

    levels: str
    there: Rate
    right: Rate
    both: Rate
    false_alarms: Rate
    misnamed: Rate


def support_table(rows: list[dict]) -> list[SupportScore]:
    """The scores of established effects, and those where supported ones count as well."""

    def scored(levels: str, result: Callable[[dict], dict]) -> SupportScore:
        def results(*kinds: str) -> list[dict]:
            return [result(row) for row in rows if row["kind"] in kinds]

        plain = [result(row) for row in rows if row["kind"] == "single" and row["plain"]]
        return SupportScore(
            levels,
            rate_of(there for row in rows for there in result(row)["there"]),
            rate_of(each["right"] for each in plain),
            rate_of(each["effects_found"] == 2 for each in results("pair")),
            rate_of(bool(each["wrong"]) for each in results("none", "off")),
            rate_of(bool(each["wrong"]) for each in results("outside")),
        )

    return [
        scored("established", lambda row: row | {"there": row["established"]}),
        scored("established or supported", lambda row: row["supported_too"]),
    ]


class PowerBin(NamedTuple):
    """Single effects whose change of the ripple lies between `low` and `high`."""

    low: float
    high: float
    alarm: Rate
    right: Rate


def power_table(rows: list[dict]) -> list[PowerBin]:
    """Detection and naming of single effects by the change that they make; no empty bins."""
    singles = [row for row in rows if row["kind"] in ("single", "indistinguishable")]
    return [
        PowerBin(low, high, _alarms(inside), rate_of(row["right"] for row in inside))
        for low, high in pairwise(CHANGE_EDGES)
        if (inside := [row for row in singles if low <= row["change"] < high])
    ]


class ProbabilityBin(NamedTuple):
    """Answers whose stated probability lies between `low` and `high`; `mean` is theirs."""

    low: float
    high: float
    mean: float
    right: Rate


def reliability_table(
    rows: list[dict], edges: Sequence[float] = PROBABILITY_EDGES
) -> list[ProbabilityBin]:
    """Named effects by their stated probability, see `bin_probabilities`."""
    return bin_probabilities([pair for row in rows for pair in row["probabilities"]], edges)


def bin_probabilities(
    stated: Sequence[tuple[float, bool]], edges: Sequence[float]
) -> list[ProbabilityBin]:
    """Pairs (stated probability, right) between the `edges`, the last of which is inside; no empty
    bins."""
    table = []
    for low, high in pairwise(edges):
        last = high == edges[-1]
        # rounding can take a probability beyond 1
        inside = [(p, right) for p, right in stated if low <= p < high or (last and p >= high)]
        if inside:
            mean = float(np.mean([p for p, _ in inside]))
            table.append(ProbabilityBin(low, high, mean, rate_of(right for _, right in inside)))
    return table


def brier_score(rows: list[dict]) -> float:
    """Mean square of stated probability less outcome (Brier, Mon. Weather Rev. 78, 1950)."""
    stated = [pair for row in rows for pair in row["probabilities"]]
    return float(np.mean([(p - right) ** 2 for p, right in stated])) if stated else float("nan")


class LineErrors(NamedTuple):
    """Mean and root mean square of relative errors, and the share within two stated deviations."""

    quantity: str
    twin: str
    mean: float
    rms: float
    within: Rate


def line_errors_of(rows: list[dict], quantity: str, twin: str) -> list[dict]:
    """Errors of all segments' "delay" or "impedance" in the "calibrated" or "corrected" twins of
    cases with an effect."""
    return [
        error
        for row in rows
        if row["effects"]
        for error in row["line_errors"][twin]
        if error["quantity"] == quantity
    ]


def line_error_table(rows: list[dict]) -> list[LineErrors]:
    """Errors of calibrated and corrected delays and impedances in cases with an effect."""
    table = []
    for quantity in ("delay", "impedance"):
        for twin in ("calibrated", "corrected"):
            errors = line_errors_of(rows, quantity, twin)
            if errors:
                relative = np.array([error["relative"] for error in errors])
                rms = float(np.sqrt(np.mean(relative**2)))
                within = rate_of(abs(error["z"]) < 2 for error in errors)
                table.append(LineErrors(quantity, twin, float(relative.mean()), rms, within))
    return table
