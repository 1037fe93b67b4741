"""A measured duct with six uncalibrated microphones and an end that is not quite anechoic."""

import h5py
import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.signal import csd

from measured_duct import calibrated, case
from paths import MEASURED

DUCT = MEASURED / "duct_six_microphones"
pytestmark = pytest.mark.skipif(
    not (DUCT / "empty.h5").exists(), reason="the measured duct is not there"
)
POSITIONS = np.array([0.0, 0.415, 0.5, 1.6, 1.685, 2.1])
END = 2.2  # m, of the data sheet's line
LOSS = 0.0186  # 1/m at 1 kHz: viscosity and conduction at the walls of a duct 0.1 m wide


def two_waves():
    """Frequencies, gains against the first microphone (6,) and reflection coefficients at END, by
    two plane waves of free amplitude at every frequency."""
    with h5py.File(DUCT / "empty.h5") as file:
        data = file["time_data"][:].T.astype(float)
    frequency_hz, power = csd(data[:, None], data[None], fs=51200.0, nperseg=8192)
    kept = (frequency_hz >= 100.0) & (frequency_hz <= 1600.0)
    frequency_hz = frequency_hz[kept]
    values, vectors = np.linalg.eigh(power[:, :, kept].transpose(2, 1, 0))
    pressure = vectors[:, :, -1] * np.sqrt(values[:, -1:])  # (F, 6)

    def waves(x):
        k = 2 * np.pi * frequency_hz / x[0] - 1j * LOSS * np.sqrt(frequency_hz / 1000.0)
        gain = np.exp(np.r_[0.0, x[1:6]] + 1j * np.r_[0.0, x[6:11]])
        travel = k[:, None] * (POSITIONS - END)
        base = gain[None, :, None] * np.stack([np.exp(-1j * travel), np.exp(1j * travel)], 2)
        left = base.conj().transpose(0, 2, 1)
        amplitudes = np.linalg.solve(left @ base, left @ pressure[:, :, None])
        return gain, amplitudes[:, :, 0], pressure - (base @ amplitudes)[:, :, 0]

    def residual(x):
        error = waves(x)[2] / np.linalg.norm(pressure)
        return np.r_[error.real.ravel(), error.imag.ravel(), 1e-3 * (x[0] - 343.4) / 3.4]

    solution = least_squares(residual, np.r_[343.4, np.zeros(10)]).x
    gain, amplitudes, _ = waves(solution)
    return frequency_hz, gain, amplitudes[:, 1] / amplitudes[:, 0]


def test_the_end_and_the_gains_are_those_of_two_plane_waves(tmp_path):
    """One passive end with a short memory and constant gains leave at most 8 % of the microphones'
    spectra. The gains are those of two free plane waves at every frequency to 0.06, and the end
    reflects as they do, to 0.06 on average."""
    duct = case(DUCT, tmp_path)
    calibration = calibrated(duct)
    assert calibration.after.relative < 0.08
    frequency_hz, gain, reflection = two_waves()
    values = calibration.twin.values()
    for k in range(2, 7):
        assert values[f"gain[m{k}]"] == pytest.approx(np.abs(gain[k - 1]), abs=0.06)
    curve = calibration.load
    size = np.interp(frequency_hz, curve.frequency_hz, np.abs(curve.reflection))
    assert np.mean(np.abs(size - np.abs(reflection))) < 0.06
