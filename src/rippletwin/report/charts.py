"""Charts of a report, made of the numbers behind the figures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rippletwin.case.model import Recording, Rig
from rippletwin.case.quantities import write_share
from rippletwin.case.words import name_state
from rippletwin.diagnosis.diagnosed_numbers import DiagnosedNumbers
from rippletwin.figures.explained_numbers import ExplainedNumbers, Point
from rippletwin.figures.explained_ripple import curve, curves_of, title_of
from rippletwin.harmonics import peak_amplitudes
from rippletwin.report.svg import Chart, Series
from rippletwin.spectra.observation import revolutions_of

PITCHES_OF_ORDERS = 12  # an order spectrum ends at that multiple of the pumping frequency
SECONDS_OF_SPECTRUM = 60.0  # of a recording: enough for an amplitude, whatever its length
RIPPLE_STEP = 2  # of the samples of a ripple one in so many is drawn


@dataclass(frozen=True)
class OrderSpectrum:
    """Amplitude (S, K) of the pressure at shaft orders 1 to K, Pa, and the mean speed in r/min."""

    label: str
    state: str
    sensors: Sequence[str]
    pistons: int
    speed_rpm: float
    amplitude: np.ndarray


def order_spectrum(recording: Recording, rig: Rig) -> OrderSpectrum:
    """The spectrum of a periodic recording averaged over the revolutions of its first minute.

    Raises InputError where no ripple repeats with the shaft.
    """
    few = recording.pressure[:, : int(SECONDS_OF_SPECTRUM * recording.sampling_rate_hz)]
    revolutions = revolutions_of(replace(recording, pressure=few), rig)
    pistons = rig.pump["pistons"]
    mean = revolutions.windows.mean(axis=0)
    count = min(PITCHES_OF_ORDERS * pistons, mean.shape[-1] // 2 - 1)
    return OrderSpectrum(
        recording.label,
        recording.state,
        [s.name for s in rig.sensors],
        pistons,
        60.0 * float(np.mean(revolutions.speed_hz)),
        np.abs(peak_amplitudes(mean)[:, 1 : count + 1]),
    )


def chart_ripples(numbers: ExplainedNumbers) -> list[Chart]:
    """Ripple of each sensor at each operating point: measured, calibrated, corrected."""
    names = curves_of(numbers)
    return [
        _ripple(point, s, names) for point in numbers.points for s in range(len(point.measured))
    ]


def _ripple(point: Point, sensor: int, names: Sequence[str]) -> Chart:
    curves = {name: curve(point, getattr(point, name)[sensor]) for name in names}
    x, _ = curves["measured"]
    step = RIPPLE_STEP if point.orders is not None else 1
    errors = ", ".join(
        f"{name} {write_share(point.misfit(getattr(point, name), sensor))}" for name in names[1:]
    )
    periodic = point.orders is not None
    unit = "bar" if periodic else "1" if point.kind == "input_impedance" else "Pa"
    what = "ripple" if periodic else "reflection" if unit == "1" else "amplitude"
    return Chart(
        f"{point.sensors[sensor]}, {title_of(point)}",
        x[::step],
        [Series(name, y[::step], name) for name, (_, y) in curves.items()],
        "shaft angle / degrees" if periodic else "frequency / Hz",
        f"{what} / {unit}" if unit != "1" else what,
        note=f"error: {errors}",
        logarithmic=unit == "Pa",
    )


def chart_residuals(numbers: ExplainedNumbers) -> list[Chart]:
    """Error over expected error against frequency: one chart an operating point, the largest of
    the sensors at each frequency."""
    return [
        Chart(
            title_of(point),
            point.frequency_hz,
            [
                Series(name, np.max(getattr(point, f"residual_{name}"), axis=0), name)
                for name in curves_of(numbers)[1:]
            ],
            "frequency / Hz",
            "error over expected error",
            note="largest of the sensors; 1 is as expected; logarithmic",
            logarithmic=True,
            mark=1.0,
        )
        for point in numbers.points
    ]


def chart_orders(spectrum: OrderSpectrum) -> list[Chart]:
    """Order spectrum of each sensor: pumping orders, and the other shaft orders."""
    orders = np.arange(1, spectrum.amplitude.shape[1] + 1)
    pumping = orders % spectrum.pistons == 0
    ticks = [float(k) for k in orders if k % (2 * spectrum.pistons) == 0] or (1.0,)
    return [
        Chart(
            f"{sensor}, {spectrum.label}",
            orders,
            [
                Series("pumping orders", np.where(pumping, a, np.nan), "corrected", "stems"),
                Series("other shaft orders", np.where(pumping, np.nan, a), "measured", "stems"),
            ],
            "shaft order",
            "amplitude / bar",
            note=f"{name_state(spectrum.state)}, {spectrum.speed_rpm:.1f} r/min; logarithmic",
            logarithmic=True,
            x_ticks=ticks,
        )
        for sensor, a in zip(spectrum.sensors, spectrum.amplitude / 1e5)
    ]


def chart_change(d: DiagnosedNumbers) -> list[Chart]:
    """Change against the healthy pump at each shaft order: measured, predicted, allowed for."""
    curves = (
        ("measured", d.measured, "measured", "dots"),
        (f"predicted: {name_state(d.probable)}", d.predicted, "predicted", "line"),
        ("error allowed for", d.allowed, "allowed", "line"),
    )
    return [
        Chart(
            f"{sensor}, {d.label}",
            np.asarray(d.orders),
            [
                Series(name, np.asarray(values[k]) / 1e5, role, form)
                for name, values, role, form in curves
            ],
            "shaft order",
            "change / bar",
            note="change against the healthy pump; logarithmic",
            logarithmic=True,
        )
        for k, sensor in enumerate(d.sensors)
    ]
