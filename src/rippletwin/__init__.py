"""rippletwin: zero-shot fault diagnosis of axial piston pumps with a self-explaining twin."""

from importlib import import_module

__version__ = "0.1.0"

_FUNCTIONS = {
    "load_case": "case.load:load_case",
    "calibrate": "calibration.calibrate_case:calibrate_case",
    "explain": "explanation.explain:explain",
    "simulate": "diagnosis.simulated_fault:simulate_fault",
    "diagnose": "diagnosis.diagnose:diagnose",
    "write_report": "report.page:report_case",
    "to_xarray": "report.labelled_arrays:to_xarray",
}
"""Functions for notebooks, each imported when it is first asked for: a room's libraries are loaded
by those who use the room."""

__all__ = ["__version__", *_FUNCTIONS]


def __getattr__(name: str):
    if name not in _FUNCTIONS:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module, _, function = _FUNCTIONS[name].partition(":")
    return getattr(import_module(f"{__name__}.{module}"), function)


def __dir__() -> list[str]:
    return sorted({*globals(), *_FUNCTIONS})
