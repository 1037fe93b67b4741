"""Figures of an explanation, each of which answers one question, and the numbers behind them."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path

from rippletwin.explanation.verdict.explanation import Explanation
from rippletwin.figures import explained_numbers, style
from rippletwin.figures.explained_numbers import ExplainedNumbers
from rippletwin.figures.explained_ripple import plot_residuals, plot_ripple
from rippletwin.figures.explained_search import plot_evidence, plot_immittance, plot_load
from rippletwin.figures.line_drawing import plot_place

FIGURES = {
    "ripple": plot_ripple,
    "residuals": plot_residuals,
    "evidence": plot_evidence,
    "place": plot_place,
    "immittance": plot_immittance,
    "load": plot_load,
}
SUFFIXES = (".png", ".svg")


def draw(
    explanation: Explanation,
    folder: str | Path,
    suffixes: Sequence[str] = SUFFIXES,
    processes: int = 1,
) -> list[Path]:
    """Write every applicable figure into `folder`/figures, once per suffix, and the numbers behind
    them; returns the paths. Those of an earlier explanation are removed."""
    folder = Path(folder)
    remove_figures(folder)
    (folder / "figures").mkdir(parents=True, exist_ok=True)
    numbers = explained_numbers.gather(explanation)
    paths = [explained_numbers.save(numbers, folder)]
    draw_one = partial(_draw_one, numbers, folder / "figures", suffixes)
    if processes < 2:
        return paths + [path for name in FIGURES for path in draw_one(name)]
    with ProcessPoolExecutor(processes, get_context("fork")) as pool:
        return paths + [path for drawn in pool.map(draw_one, FIGURES) for path in drawn]


def remove_figures(folder: str | Path) -> None:
    """Remove what `draw` has written into `folder`: beside another verdict it would be wrong."""
    folder = Path(folder)
    (folder / explained_numbers.FILE).unlink(missing_ok=True)
    for name in FIGURES:
        for path in _paths(folder / "figures", name, SUFFIXES):
            path.unlink(missing_ok=True)


def _paths(folder: Path, name: str, suffixes: Sequence[str]) -> list[Path]:
    return [folder / f"explain_{name}{suffix}" for suffix in suffixes]


def _draw_one(
    numbers: ExplainedNumbers, folder: Path, suffixes: Sequence[str], name: str
) -> list[Path]:
    figure = FIGURES[name](numbers)
    if figure is None:
        return []
    paths = _paths(folder, name, suffixes)
    style.save(figure, *paths)
    return paths
