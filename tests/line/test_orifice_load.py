"""The orifice at full amplitude: its answer obeys the law at each instant, and its transform is
that of NumPy."""

import numpy as np
import pytest

from rippletwin.line.frequency_domain.orifice_load import OrificeLoad, _transform

DROP, COEFFICIENT = 9e6, 0.7e-3 / np.sqrt(9e6)


@pytest.mark.parametrize("count", [4, 8, 16, 256, 2048])
def test_the_transform_is_that_of_numpy(count):
    """To rounding, for complex signals of every length that is used."""
    rng = np.random.default_rng(count)
    signal = rng.normal(size=count) + 1j * rng.normal(size=count)
    re, im, phase = signal.real.copy(), signal.imag.copy(), 2 * np.pi * np.arange(count) / count
    _transform(re, im, np.empty(count), np.empty(count), np.cos(phase), np.sin(phase))
    assert re + 1j * im == pytest.approx(np.fft.fft(signal), abs=1e-12 * count)


@pytest.mark.parametrize("valve", [False, True])
@pytest.mark.parametrize("orders", [np.arange(1, 120), 9 * np.arange(1, 27)])
def test_the_answer_obeys_line_and_law(orders, valve):
    """a p + b q = c at each harmonic, and q is what K (1 + y) sqrt(P + p) has at that harmonic,
    calculated from the waves over a period; y = H p/(2 P). The second recording has half of the
    harmonics, its own drop, and is solved beside the first."""
    count = len(orders)
    both = np.concatenate([orders, orders[: count // 2]])
    slices = [slice(0, count), slice(count, len(both))]
    drop, coefficient = np.array([DROP, 0.6 * DROP]), np.array([COEFFICIENT, 1.3 * COEFFICIENT])
    rng = np.random.default_rng(1)
    slope = coefficient / (2 * np.sqrt(drop))
    admittance = np.repeat(slope, [s.stop - s.start for s in slices]).astype(complex)
    opening = np.full(len(both), 0.3 - 0.1j) if valve else None
    if valve:
        admittance = admittance * (1.0 + opening)
    a, b = 1.0 + 0.2j * rng.normal(size=(2, len(both)))
    b = b * 2e10
    size = 0.05 * DROP / np.sqrt(count) * np.exp(2j * np.pi * rng.random(len(both)))
    c = (a + b * admittance) * size
    p, q = OrificeLoad(slices, both, drop, coefficient).solve(a, b, c, admittance, 1.0, opening)
    assert np.abs(a * p + b * q - c).max() < 1e-9 * np.abs(c).max()
    angle = 2 * np.pi * np.arange(4096) / 4096
    for part, pressure, k in zip(slices, drop, coefficient):
        waves = np.exp(1j * np.outer(both[part], angle))
        swing = (p[part] @ waves).real
        y = 0.0 if opening is None else (opening[part] * p[part] @ waves).real / (2 * pressure)
        flow = k * (1.0 + y) * np.sqrt(pressure + swing)
        expected = 2 / len(angle) * (flow @ waves.conj().T)
        assert np.abs(q[part] - expected).max() < 1e-5 * np.abs(expected).max()
        linear = admittance[part] * p[part]
        assert np.abs(linear - expected).max() > 1e-3 * np.abs(expected).max()  # it bends


def load_of_line(size, resistance):
    """(`OrificeLoad`, its arguments): a line of `resistance` over the load's, whose linear load
    pressure is `size` of the drop at the first harmonic and falls as 1/k."""
    orders = 9 * np.arange(1, 20)
    admittance = np.full(19, COEFFICIENT / (2 * np.sqrt(DROP)), complex)
    a, b = np.ones(19, complex), resistance / admittance
    c = (a + b * admittance) * size * DROP / np.arange(1, 20) * np.exp(1j * np.arange(19))
    load = OrificeLoad([slice(0, 19)], orders, np.array([DROP]), np.array([COEFFICIENT]))
    return load, (a, b, c, admittance, 1.0)


def test_a_drop_that_nearly_vanishes_is_solved_by_short_passes():
    """Whole passes alone swing for ever here; the answer obeys the line and the law."""
    load, (a, b, c, admittance, _) = load_of_line(1.0, 30.0)
    p, q = load.solve(a, b, c, admittance, 1.0)
    assert load.solved
    assert np.abs(a * p + b * q - c).max() < 1e-9 * np.abs(c).max()
    waves = np.exp(9j * np.outer(np.arange(1, 20), 2 * np.pi * np.arange(4096) / 4096))
    drop = DROP + (p @ waves).real
    assert 0.01 < drop.min() / DROP < 0.2
    expected = 2 / 4096 * ((COEFFICIENT * np.sqrt(drop)) @ waves.conj().T)
    assert np.abs(q - expected).max() < 1e-2 * np.abs(expected).max()


def test_an_iteration_that_does_not_settle_is_not_claimed_solved():
    """Four times the drop, where the law has no real root: the last iterate is flagged; the next
    problem is solved all the same."""
    load, arguments = load_of_line(4.0, 30.0)
    load.solve(*arguments)
    assert not load.solved
    load.solve(*load_of_line(0.05, 30.0)[1])
    assert load.solved
