"""Observations against synthetic signals of known harmonics, noise and speed variation."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from case_folders import ripple as steady_ripple
from rippletwin.case.model import Fluid, Load, Recording, Rig, Segment, Sensor
from rippletwin.errors import InputError
from rippletwin.spectra.angular_resampling import cut_revolutions, interpolate
from rippletwin.spectra.interpolation_kernel import sum_taps
from rippletwin.spectra.noise import noise_cycle_scatter, noise_mad
from rippletwin.spectra.observation import observe

RATE, PISTONS, SPEED_HZ = 51200.0, 9, 1000 / 60
RIG = Rig(
    fluid=Fluid(870, 3.2e-5),
    pump={"pistons": PISTONS},
    line=(Segment(5.95, 0.0197, 1020), Segment(3.0, 0.0197, 1000)),
    sensors=(Sensor("p1", 0.42), Sensor("p2", 2.59)),
    load=Load("orifice"),
)


def harmonics(rng, highest=299, sensors=2):
    """Peak amplitudes (S, K), Pa: strong piston harmonics that fall as 1/k, weak shaft orders."""
    k = np.arange(1, highest + 1)
    size = np.where(k % PISTONS == 0, 2e5 * PISTONS / k, 300.0)
    draws = rng.normal(size=(2, sensors, highest))
    return size * (draws[0] + 1j * draws[1])


def ripple(amplitudes, seconds=4.0, wander=3e-3, wander_hz=0.7, rate=RATE):
    """The ripple (S, N) of a shaft that wanders by +-`wander`, Pa, about 9.5 MPa."""
    t = np.arange(int(seconds * rate)) / rate
    angle = SPEED_HZ * (
        t + wander * (1 - np.cos(2 * np.pi * wander_hz * t)) / (2 * np.pi * wander_hz)
    )
    turn = np.exp(2j * np.pi * angle)
    total = np.zeros((len(amplitudes), t.size), complex)
    for column in amplitudes.T[::-1]:  # Horner's rule
        total = (total + column[:, None]) * turn
    return 9.5e6 + total.real


def recording(pressure, kind="periodic", speed_rpm=1002.0):
    return Recording(
        file="synthetic",
        kind=kind,
        state="healthy",
        label="synthetic",
        speed_rpm=speed_rpm,
        load_pressure=9.5e6,
        sampling_rate_hz=RATE,
        pressure=pressure,
    )


def turned(values, truth, orders):
    """`values` turned by the one unknown, the shaft angle, to lie on `truth`."""

    def at(angle):
        return values * np.exp(-1j * orders * angle)

    def cost(angle):
        return np.sum(np.abs(at(angle) - truth) ** 2)

    guesses = np.arange(0, 2 * np.pi, 0.2 / orders.max())
    best = min(guesses, key=cost)
    step = 0.2 / orders.max()
    return at(minimize_scalar(cost, bounds=(best - step, best + step), options={"xatol": 1e-9}).x)


@pytest.mark.parametrize("wander_hz", [0.3, 2.0])
def test_harmonics_survive_speed_wander(wander_hz):
    """Amplitudes to 1e-3 of the largest at their frequency, from a speed wandering by +-0.3 %.

    Truth: the amplitudes the signal was made of. No noise, nominal speed wrong by 0.2 %.
    """
    truth = harmonics(np.random.default_rng(1))
    seen = observe(recording(ripple(truth, wander_hz=wander_hz)), RIG)
    assert seen.speed_hz == pytest.approx(SPEED_HZ, rel=1e-3)
    assert seen.mean == pytest.approx(9.5e6, rel=1e-6)
    found = turned(seen.values, truth[:, : seen.orders.size], seen.orders)
    truth = truth[:, : seen.orders.size]
    piston = seen.orders % PISTONS == 0
    error = np.abs(found - truth) / np.abs(truth).max(axis=0)
    assert error[:, piston].max() < 1e-3
    assert np.linalg.norm(found - truth) < 2e-4 * np.linalg.norm(truth)


def test_covariance_is_that_of_repeated_draws():
    """chi^2 of the errors over repeated noise draws is its degrees of freedom, to 5 %.

    Truth: the noise-free observation of the same signal. The noises of the sensors are correlated,
    so the off-diagonal elements count. Orders other than the piston harmonics, which fix the shaft
    angle, are judged; 8 draws of 266 orders and two sensors have a spread of 1.5 %.
    """
    rng = np.random.default_rng(2)
    clean = ripple(harmonics(rng), seconds=3.0, wander=1e-4)
    truth = observe(recording(clean), RIG)
    mix = np.array([[1000.0, 0.0], [600.0, 800.0]])
    judged = truth.orders % PISTONS != 0
    chi2 = []
    for _ in range(8):
        seen = observe(recording(clean + mix @ rng.normal(size=clean.shape)), RIG)
        found = turned(seen.values, truth.values, truth.orders)
        error = (found - truth.values)[:, judged].T
        solved = np.linalg.solve(seen.covariance[judged], error[:, :, None])[:, :, 0]
        chi2.append(np.sum(error.conj() * solved, axis=1).real)
    assert np.mean(chi2) / 2 == pytest.approx(1.0, abs=0.05)


def test_a_line_that_depends_on_the_speed_is_observed_at_the_mean_speed():
    """A delay of 5 ms between shaft and sensor does not reduce the high harmonics.

    Truth: the amplitude at constant speed. Averaging windows loses 0.2 % at 5 kHz for a
    wander of 0.1 % rms and more for more; here 0.2 % rms would lose several per cent.
    """
    truth = harmonics(np.random.default_rng(3), sensors=1)
    whole = ripple(truth, seconds=9.6, wander_hz=0.4)
    both = np.vstack([whole[:, 256:], whole[:, :-256]])
    seen = observe(recording(both), RIG)
    piston = seen.orders % PISTONS == 0
    ratio = np.abs(seen.values) / np.abs(truth[:, : seen.orders.size])
    assert np.abs(ratio[:, piston] - 1).max() < 0.01


def test_interpolation_error_is_far_below_noise():
    """A 5 kHz tone sampled at 51.2 kHz is interpolated to 1e-5, a 20 kHz tone to 1e-4.

    Truth: the tone itself.
    """
    n = np.arange(4000)
    position = np.linspace(100, 3900, 3001)
    for frequency, bound in ((5000, 1e-5), (20000, 1e-4)):
        omega = 2 * np.pi * frequency / RATE
        found = interpolate(np.sin(omega * n)[None], position)[0]
        assert np.abs(found - np.sin(omega * position)).max() < bound


def test_compiled_sums_of_taps_are_those_of_numpy():
    """Every sample's weight by interpolation in the table, the signal constant beyond its ends."""
    rng = np.random.default_rng(2)
    signal, table = rng.normal(size=(2, 30)).astype(np.float32), rng.normal(size=(9, 5))
    position, before = np.array([-7.3, 0.2, 11.0, 11.999, 20.63, 29.5, 40.0]), 2
    base = np.floor(position).astype(int)
    weights = [
        [np.interp(x, np.linspace(0, 1, 9), column) for column in table.T] for x in position - base
    ]
    near = np.clip(base[:, None] - before + np.arange(5), 0, 29)
    expected = np.einsum("spt,pt->sp", signal[:, near], weights)
    np.testing.assert_allclose(sum_taps(signal, position, table, before), expected, rtol=1e-12)


def test_windows_have_the_asked_length_and_repeat():
    """Windows of 3072 samples repeat to 1e-3 of the ripple although the speed wanders."""
    clean = ripple(harmonics(np.random.default_rng(4)), seconds=2.0)
    cut = cut_revolutions(clean, RATE, PISTONS, 1000.0, 3072)
    assert cut.windows.shape[1:] == (2, 3072)
    assert len(cut.windows) == len(cut.speed_hz) >= 30
    assert np.all(noise_cycle_scatter(cut.windows) < 1e-3 * np.std(clean, axis=1))


def test_both_noise_estimates_find_the_noise():
    """Wavelet MAD and cycle scatter both read the white noise put in, to 5 %."""
    rng = np.random.default_rng(5)
    noise = np.array([500.0, 4000.0])
    clean = ripple(harmonics(rng), seconds=4.0)
    noisy = clean + noise[:, None] * rng.normal(size=clean.shape)
    assert noise_mad(noisy) == pytest.approx(noise, rel=0.05)
    windows = cut_revolutions(noisy, RATE, PISTONS, 1000.0).windows
    assert noise_cycle_scatter(windows) == pytest.approx(noise, rel=0.05)


@pytest.mark.parametrize("shape", ["ramp", "half a wave"])
def test_drift_of_a_sensor_makes_no_harmonics(shape):
    """A drift of the sensors by 20 and -10 kPa over the recording changes no order below the
    pistons' by more than 2 Pa. The ramp in each revolution would change the first by 95 Pa, and a
    drift that comes back by 3.6 Pa. Truth: the same ripple without drift."""
    clean = ripple(harmonics(np.random.default_rng(6)))
    time = np.linspace(0.0, 1.0, clean.shape[1])
    slow = {"ramp": time, "half a wave": np.sin(np.pi * time)}[shape]
    drifted = clean + np.array([[2e4], [-1e4]]) * slow
    values = [observe(recording(p), RIG).values for p in (clean, drifted)]
    assert np.abs(values[1] - values[0])[:, : PISTONS - 1].max() < 2.0


def test_piston_harmonics_only_and_highest_frequency():
    """The choice of orders is a choice only: the values kept are the same to 1e-5."""
    clean = ripple(harmonics(np.random.default_rng(6)), seconds=1.0)
    everything = observe(recording(clean), RIG)
    some = observe(recording(clean), RIG, max_frequency_hz=1500, piston_harmonics_only=True)
    assert list(some.orders) == list(range(9, 90, 9))
    np.testing.assert_allclose(some.values, everything.values[:, some.orders - 1], rtol=1e-5)


def test_random_recording_gives_the_response_between_sensors():
    """Broadband noise through a known echo: p2/p1 = H and its scatter fits the covariance
    of both.

    Truth: p1 = w, p2(t) = 0.8 w(t - 3 ms) + 0.3 w(t - 7 ms) made on the sample grid, with equal
    noise on both; chi^2 per complex value is 1 to 10 %.
    """
    rng = np.random.default_rng(7)
    lags, gains = np.array([154, 358]), np.array([0.8, 0.3])
    source = 2000 * rng.normal(size=int(40 * RATE) + 400)
    first = source[400:]
    second = sum(g * source[400 - lag : source.size - lag] for lag, g in zip(lags, gains))
    pressure = np.array([first, second]) + 60 * rng.normal(size=(2, first.size))
    seen = observe(recording(pressure, kind="random"), RIG)
    turn = np.exp(-2j * np.pi * np.outer(seen.frequency_hz / RATE, lags)) @ gains
    error = seen.values[1] / seen.values[0] - turn
    direction = np.stack([-turn, np.ones_like(turn)])
    variance = np.einsum("sf,fst,tf->f", direction, seen.covariance, direction.conj()).real
    variance = variance / np.abs(seen.values[0]) ** 2
    assert seen.source == "free" and seen.orders is None
    assert np.sqrt(np.mean(np.abs(error) ** 2)) < 0.02
    assert np.mean(np.abs(error) ** 2 / variance) == pytest.approx(1.0, abs=0.1)


def test_random_recording_is_not_biased_by_noise_of_the_first_sensor():
    """With noise a third of the signal, the H1 estimator is 10 % low; the mean ratio here is within
    1 %.

    Truth: both sensors see the same signal.
    """
    rng = np.random.default_rng(8)
    source = 3000 * rng.normal(size=int(20 * RATE))
    pressure = source + 1000 * rng.normal(size=(2, source.size))
    seen = observe(recording(pressure, kind="random"), RIG)
    assert np.mean(seen.values[1] / seen.values[0]).real == pytest.approx(1.0, abs=0.01)


def spectrum(values, kind, **fields):
    return Recording(
        file="synthetic",
        kind=kind,
        state="healthy",
        label="synthetic",
        frequency_hz=np.linspace(50, 3000, values.shape[-1]),
        spectra=values,
        **fields,
    )


def test_repeats_of_an_impedance_give_its_covariance():
    """Five repeats with 3 % error in the reflection coefficient: chi^2 of their mean is 1 to 10 %.

    Truth: the impedance of a lossy open tube, whose maxima are a hundred times its minima.
    """
    rng = np.random.default_rng(9)
    frequency = np.linspace(50, 3000, 2951)
    reflection = -0.97 * np.exp(-2j * np.pi * frequency * 2.6e-3)
    chi2 = []
    for _ in range(20):
        noise = rng.normal(size=(2, 5, 1, 2951)) * 0.03 / np.sqrt(2)
        # small against 1 - |R|, so that Z is near to linear in R
        noise *= 0.1
        measured = reflection + noise[0] + 1j * noise[1]
        seen = observe(
            spectrum((1 + measured) / (1 - measured), "input_impedance", normalised=True), RIG
        )
        error = seen.values[0] - (1 + reflection) / (1 - reflection)
        chi2.append(np.abs(error) ** 2 / seen.covariance[:, 0, 0].real)
    assert seen.source == "known" and seen.normalised
    assert np.mean(chi2) == pytest.approx(1.0, abs=0.1)


def test_a_silent_row_at_0_hz_has_no_part_in_the_scatter():
    """Three repeats of a table that begins with zeros at 0 Hz have the covariance of the same table
    without that row."""
    rng = np.random.default_rng(3)
    values = rng.normal(size=(3, 2, 60)) + 1j * rng.normal(size=(3, 2, 60))
    table = spectrum(values, "spectrum")
    silent = replace(
        table,
        frequency_hz=np.append(0.0, table.frequency_hz),
        spectra=np.concatenate([np.zeros((3, 2, 1)), values], axis=2),
    )
    one, other = observe(table, RIG), observe(silent, RIG)
    assert np.array_equal(one.covariance, other.covariance)
    assert np.array_equal(one.values, other.values) and np.isfinite(one.covariance).all()


def test_one_spectrum_has_the_stated_relative_error():
    """Without repeats the deviation is `relative_error` (0.02 by default) of the sensors' rms."""
    values = np.array([[[3.0 + 4.0j], [0.0 + 0.0j]]])
    for fields, relative in (({}, 0.02), ({"relative_error": 0.1}, 0.1)):
        seen = observe(spectrum(values, "spectrum", **fields), RIG)
        expected = (relative * 5 / np.sqrt(2)) ** 2
        np.testing.assert_allclose(seen.covariance[0], expected * np.eye(2))
        assert seen.source == "free"


@pytest.mark.parametrize(
    ("pressure", "speed_rpm"),
    [
        (9.5e6 + np.random.default_rng(1).normal(scale=1e3, size=(2, int(RATE))), 1000.0),
        (steady_ripple(seconds=3.0), 800.0),
    ],
    ids=["still", "another speed"],
)
def test_a_ripple_that_does_not_repeat_with_the_shaft_is_bad_input(pressure, speed_rpm):
    """Noise of a pump that stands still, and a speed that is 20 % wrong: the recording's file and
    its speed are named, with a remedy."""
    with pytest.raises(InputError) as caught:
        observe(recording(pressure, speed_rpm=speed_rpm), RIG)
    error = caught.value
    assert (error.file, error.field) == ("synthetic", "speed_rpm")
    assert error.problem == f"no ripple repeats with the shaft at {speed_rpm:g} r/min"
    assert "pump.pistons" in error.remedy
