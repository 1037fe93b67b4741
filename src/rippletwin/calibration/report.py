"""A calibration as plain data (for twin.json) and as a page to read (for report.md)."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from rippletwin import store
from rippletwin.calibration.calibrate import Calibration
from rippletwin.calibration.misfit import Misfit, with_likely_amplitude
from rippletwin.case.quantities import unit_of, write_number, write_stated, write_value
from rippletwin.case.words import name_parameter
from rippletwin.twin import twin_file
from rippletwin.twin.unknown_load import LoadCurve

LOAD_ROWS_STEP = 8  # frequencies of the load's curve from one row to the next
RIPPLE_DEG = 360 * np.arange(1024) / 1024  # crank angles at which ripples are drawn

UNEVENNESS = 0.0015
"""Relative standard deviation of a segment's wave speed as one number for all of it: it falls by
0.3 % a kelvin (Gholizadeh, Burton and Schoenau 2011, Int. J. Fluid Power 12(3):5), and a line is
half a kelvin warmer in places."""


def segment_table(calibration: Calibration) -> list[dict]:
    """Delay L/a (s) and characteristic impedance rho a/A (Pa s/m3) of each segment.

    Waves depend on these two, so the data determine them better than a, D and L alone. Standard
    deviations are of first order in the logarithms, with their covariance. That of a delay is at
    least UNEVENNESS: along a segment the wave speed is not one number.
    """
    twin, covariance = calibration.twin, calibration.covariance
    v = twin.arrays(twin.theta)
    rows = []
    for k, (a, d, length) in enumerate(zip(v.wave_speeds, v.diameters, v.lengths)):
        names = [f"{name}[{k + 1}]" for name in ("wave_speed", "diameter", "length")]
        index = [twin.index[name] for name in names]
        sd = np.array([twin.parameters[i].prior.scale for i in index])
        log_covariance = covariance[np.ix_(index, index)] * np.outer(sd, sd)
        delay_weights, impedance_weights = np.array([-1, 0, 1]), np.array([1, -2, 0])
        delay, impedance = length / a, twin.rig.fluid.density * a / (0.25 * np.pi * d**2)
        rows.append(
            {
                "segment": k + 1,
                "delay": float(delay),
                "delay_sd": float(
                    delay * np.hypot(_root(delay_weights, log_covariance), UNEVENNESS)
                ),
                "impedance": float(impedance),
                "impedance_sd": float(impedance * _root(impedance_weights, log_covariance)),
            }
        )
    return rows


def parameter_table(calibration: Calibration) -> list[dict]:
    """Name, place, unit, nominal, value and standard deviation of each parameter.

    `pull` is the distance from the data sheet and `known` the posterior standard deviation, both in
    prior standard deviations; None without a prior.
    """
    twin = calibration.twin
    return [
        {
            "name": p.name,
            "place": p.place,
            "unit": p.unit,
            "nominal": p.nominal,
            "value": float(p.value(u)),
            "sd": p.value_sd(u, s),
            "pull": None if p.flat else float(u),
            "known": None if p.flat else float(s),
        }
        for p, u, s in zip(twin.parameters, twin.theta, calibration.sd)
    ]


def to_dict(calibration: Calibration) -> dict:
    """A calibration as plain data; `twin_file.twin_of` makes a twin of it again."""
    objective = calibration.objective  # not finite where no steady state was found
    return {
        "twin": twin_file.to_dict(calibration.twin),
        "covariance": calibration.covariance.tolist(),
        "parameters": parameter_table(calibration),
        "segments": segment_table(calibration),
        "load": None if calibration.load is None else calibration.load.as_dict(),
        "error_floor": calibration.model_error,
        "source_sd": calibration.source_sd,
        "minus_log_posterior": objective if np.isfinite(objective) else None,
        "fit": {"before": _misfit(calibration.before), "after": _misfit(calibration.after)},
        "warnings": list(calibration.warnings),
    }


def to_markdown(calibration: Calibration) -> str:
    """The report.md of a calibration: misfits, warnings, segments and parameters, in units of a
    test bench."""
    before, after = calibration.before, calibration.after
    lines = [
        "# Calibration",
        "",
        "| sensor | relative misfit before | after | Theil before | after |",
        "|---|---|---|---|---|",
        f"| all | {before.relative:.1%} | {after.relative:.1%} "
        f"| {before.theil:.3f} | {after.theil:.3f} |",
    ]
    for name in after.relative_by_sensor:
        lines.append(
            f"| {name} | {before.relative_by_sensor[name]:.1%} "
            f"| {after.relative_by_sensor[name]:.1%} "
            f"| {before.theil_by_sensor[name]:.3f} | {after.theil_by_sensor[name]:.3f} |"
        )
    lines += ["", "## Warnings", ""]
    lines += [f"* {warning}" for warning in calibration.warnings] or ["None."]
    lines += [
        "",
        "## Segments",
        "",
        "| segment | delay, ms | sd | impedance, bar per L/min | sd |",
        "|---|---|---|---|---|",
    ]
    impedance = unit_of("Pa s/m3").factor
    for row in segment_table(calibration):
        lines.append(
            f"| {row['segment']} | {1e3 * row['delay']:.4f} | {1e3 * row['delay_sd']:.2g} "
            f"| {impedance * row['impedance']:.4g} | {impedance * row['impedance_sd']:.2g} |"
        )
    if calibration.load is not None:
        lines += _load_table(calibration.load)
    lines += [
        "",
        "## Parameters",
        "",
        "Pull: distance from the data sheet in its standard deviations. Known: posterior over",
        "prior standard deviation; near 1 the data say nothing.",
        "",
        "| parameter | data sheet | calibrated | sd | pull | known |",
        "|---|---|---|---|---|---|",
    ]
    for row in parameter_table(calibration):
        pull = "" if row["pull"] is None else f"{row['pull']:+.2f}"
        known = "" if row["known"] is None else f"{row['known']:.2f}"
        unit, sd = unit_of(row["unit"], row["name"]), row["sd"]
        value = write_value(row["value"], unit, (row["value"] - sd, row["value"] + sd))
        lines.append(
            f"| {name_parameter(row['name'])} | {write_stated(row['nominal'], unit)} | {value} "
            f"| {write_number(sd * unit.factor, significant=2)} | {pull} | {known} |"
        )
    lines += [
        "",
        f"Relative error of the model: {calibration.model_error:.2%}; "
        f"relative error of the source: {calibration.source_sd:.2%}.",
    ]
    return "\n".join(lines) + "\n"


def _load_table(curve: LoadCurve) -> list[str]:
    """Reflection coefficient of an unknown load at every LOAD_ROWS_STEPth frequency."""
    lines = [
        "",
        "## Load",
        "",
        "Reflection coefficient of the unknown load; all frequencies are in twin.json.",
        "",
        "| frequency, Hz | amplitude | phase, deg | sd |",
        "|---|---|---|---|",
    ]
    rows = zip(curve.frequency_hz, curve.reflection, curve.sd)
    for f, r, sd in list(rows)[::LOAD_ROWS_STEP]:
        lines.append(f"| {f:.0f} | {abs(r):.3f} | {np.rad2deg(np.angle(r)):.0f} | {sd:.2g} |")
    return lines


def compute_ripples(
    calibration: Calibration, observations: Sequence
) -> list[dict[str, np.ndarray]]:
    """Pressure ripples to draw, one dictionary for each periodic observation.

    label       of the observation
    measured, nominal, calibrated   (S, len(RIPPLE_DEG)) Pa without mean, from the same harmonics; a
                free source has its most likely amplitude
    """
    out = []
    for o in observations:
        if o.orders is None:
            continue
        turn = np.exp(1j * np.outer(o.orders, np.deg2rad(RIPPLE_DEG)))
        spectra = {
            "measured": o.values,
            "nominal": with_likely_amplitude(o, calibration.nominal.predict([o])[0], o.values),
            "calibrated": with_likely_amplitude(o, calibration.twin.predict([o])[0], o.values),
        }
        out.append(
            {
                "label": o.label,
                **{name: (x @ turn).real for name, x in spectra.items()},
            }
        )
    return out


def save(calibration: Calibration, folder: str | Path) -> None:
    """Write twin.json and report.md into `folder`, both whole or not at all."""
    twin = json.dumps(to_dict(calibration), indent=1) + "\n"
    store.write_texts(folder, {"twin.json": twin, "report.md": to_markdown(calibration)})


def _root(weights: np.ndarray, covariance: np.ndarray) -> float:
    return float(np.sqrt(weights @ covariance @ weights))


def _misfit(m: Misfit) -> dict:
    return {
        "relative": m.relative,
        "theil": m.theil,
        "by_sensor": {
            name: {"relative": m.relative_by_sensor[name], "theil": m.theil_by_sensor[name]}
            for name in m.relative_by_sensor
        },
    }
