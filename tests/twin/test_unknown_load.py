"""The unknown load, and uncalibrated sensors, against lines whose ends are known."""

from dataclasses import replace

import numpy as np
import pytest

from rippletwin.calibration.calibrate import calibrate
from rippletwin.calibration.report import to_markdown
from rippletwin.case.model import Fluid, Load, Rig, Segment, Sensor, Uncertainty
from rippletwin.spectra.observation import Observation
from rippletwin.twin import twin_file
from rippletwin.twin.forward_jacobian import DifferentiableForward
from rippletwin.twin.forward_model import ForwardModel
from rippletwin.twin.operating_point import OperatingCondition
from rippletwin.twin.twin import Twin
from two_domains import ORDERS, both, misfit, ripple
from two_domains import rig as short_rig

FREQUENCY = np.linspace(40.0, 1600.0, 120)
GAINS = np.array([1.0, 1.11 * np.exp(0.03j), 0.95 * np.exp(-0.05j), 1.08])


def rig(load=None, gain_sd=0.1):
    sensors = tuple(Sensor(f"m{k}", x) for k, x in enumerate((0.05, 0.41, 1.1, 1.25)))
    uncertainty = Uncertainty(wave_speed=0.01, sensor_position=1e-3, sensor_gain=gain_sd)
    air = Fluid(1.2, 1.5e-5, 1.4, 0.71)
    line = (Segment(1.4, 0.1, 343.4),)
    return Rig(air, {}, line, sensors, load or Load("unknown"), uncertainty)


def impedance(frequency_hz):
    """A resistance beside a volume, behind another resistance: in Pa s/m3."""
    characteristic = 1.2 * 343.4 / (0.25 * np.pi * 0.1**2)
    return characteristic * (0.5 + 2.0 / (1.0 + 2j * np.pi * frequency_hz * 3e-4))


def spectrum(seed=1):
    """What the sensors read of a line with that end, a free source and 0.2 % of noise."""
    known = rig(Load("impedance", frequency_hz=FREQUENCY, impedance=impedance(FREQUENCY)), 0.0)
    condition = OperatingCondition("a", FREQUENCY, kind="spectrum", source="free")
    rng = np.random.default_rng(seed)
    clean = GAINS[:, None] * Twin(known).predict([condition])[0]
    sd = 2e-3 * np.abs(clean)
    noise = (rng.normal(size=(*clean.shape, 2)) @ [1.0, 1j]) * sd / np.sqrt(2)
    covariance = np.einsum("sf,st->fst", sd**2, np.eye(4)).astype(complex)
    return Observation(
        kind="spectrum",
        label="a",
        frequency_hz=FREQUENCY,
        orders=None,
        values=clean + noise,
        covariance=covariance,
        mean=np.zeros(4),
        speed_hz=None,
        load_pressure=None,
        source="free",
        flow_ripple=None,
        sensors=known.sensors,
    )


def test_calibration_finds_the_end_and_the_gains():
    """The reflection coefficient of a known end is found to 0.01, with the stated intervals about
    it; gains against the first sensor to 1 %, phases to 0.01 rad."""
    observation = spectrum()
    calibration = calibrate(Twin(rig(), [observation]), [observation])
    curve = calibration.load
    z = impedance(curve.frequency_hz) / (1.2 * 343.4 / (0.25 * np.pi * 0.1**2))
    error = np.abs(curve.reflection - (z - 1.0) / (z + 1.0))
    assert np.max(error) < 0.02 and np.sqrt(np.mean(error**2)) < 0.01
    assert calibration.after.relative < 0.01
    values = calibration.twin.values()
    for k, sensor in enumerate(rig().sensors[1:], 1):
        assert values[f"gain[{sensor.name}]"] == pytest.approx(np.abs(GAINS[k]), rel=0.01)
        assert values[f"phase[{sensor.name}]"] == pytest.approx(np.angle(GAINS[k]), abs=0.01)
    assert not any("reflection" in warning for warning in calibration.warnings)
    assert "## Load" in to_markdown(calibration)


def test_derivatives_equal_difference_quotients():
    """Every column, those of the end, gains and phases included, to 1e-3."""
    observation = spectrum()
    twin = Twin(rig(), [observation])
    theta = 0.5 * np.random.default_rng(3).normal(size=len(twin.parameters))
    columns = DifferentiableForward(twin, [observation]).derivatives(theta)
    forward, step = ForwardModel(twin, [observation]), 1e-5
    for k, column in enumerate(columns):
        unit = step * np.eye(len(theta))[k]
        quotient = (forward(theta + unit)[0] - forward(theta - unit)[0]) / (2 * step)
        assert np.linalg.norm(column - quotient) < 1e-3 * np.linalg.norm(quotient)


def test_twin_json_keeps_the_load_and_the_gains():
    """A twin that is written and read again predicts the same."""
    observation = spectrum()
    twin = Twin(rig(), [observation])
    twin = twin.with_(theta=0.3 * np.random.default_rng(4).normal(size=len(twin.parameters)))
    again = twin_file.from_dict(twin_file.to_dict(twin))
    np.testing.assert_allclose(again.predict([observation])[0], twin.predict([observation])[0])


def test_the_unknown_load_is_the_same_in_both_domains():
    """Time domain by the passive fit of its impedance, frequency domain by Schur's recursion:
    readings of an uncalibrated sensor too agree to 0.5 % of the ripple below 5 kHz."""
    unknown = replace(short_rig(), load=Load("unknown"), uncertainty=Uncertainty(sensor_gain=0.1))
    twin = Twin(unknown, [OperatingCondition("a", source="nominal")])
    rng = np.random.default_rng(5)
    free = [p.place == "load" or p.name.startswith(("gain", "phase")) for p in twin.parameters]
    twin = twin.with_(theta=np.where(free, 0.7 * rng.normal(size=len(free)), 0.0))
    moc, chain = both(twin)
    assert misfit(moc, chain) < 0.005
    other = Twin(short_rig("anechoic")).respond(ripple(), 25.0, 9.5e6, ORDERS)
    assert misfit(other, chain) > 0.1
