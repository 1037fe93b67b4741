"""Which recordings are diagnosed: those of one operating point."""

import pytest

from rippletwin.case.diagnosed_point import recordings_to_diagnose
from rippletwin.case.model import Recording


def recording(label, state, speed_rpm=1000.0, load_pressure=9.5e6, kind="periodic"):
    return Recording(
        file=None,
        label=label,
        kind=kind,
        state=state,
        speed_rpm=speed_rpm,
        load_pressure=load_pressure,
    )


def labels(recordings):
    return [[r.label for r in part] for part in recordings_to_diagnose(recordings)]


def test_the_first_recording_that_is_not_healthy_decides():
    """Healthy recordings of its speed and pressure come along, in their order; those of another
    speed or pressure do not, and an impedance is no recording of the pump's state."""
    case = [
        recording("elsewhere", "healthy", load_pressure=5e6),
        recording("healthy", "healthy"),
        recording("impedance", "healthy", kind="input_impedance"),
        recording("slipper", "slipper"),
        recording("faster", "unknown", speed_rpm=1500.0),
    ]
    assert labels(case) == [["healthy", "slipper"], ["elsewhere", "faster"]]


def test_close_points_are_one():
    """7.08, 7.077 and 7.09 MPa are one setting of a valve, 1000 and 1002 r/min one of a drive;
    7.3 MPa and 1010 r/min are others, and none is lost."""
    case = [
        recording("unknown", "unknown", load_pressure=7.08e6),
        recording("healthy", "healthy", load_pressure=7.077e6, speed_rpm=1002.0),
        recording("later", "unknown", load_pressure=7.09e6),
        recording("loaded", "unknown", load_pressure=7.3e6),
        recording("faster", "unknown", load_pressure=7.08e6, speed_rpm=1010.0),
    ]
    assert labels(case) == [["unknown", "healthy", "later"], ["loaded", "faster"]]


def test_healthy_recordings_alone_are_those_of_the_first_point():
    """Nothing is to be diagnosed yet: the first recording decides."""
    case = [recording("a", "healthy", speed_rpm=1500.0), recording("b", "healthy")]
    assert labels(case) == [["a"], ["b"]]


def test_a_case_without_the_pumps_ripple_has_nothing_to_diagnose():
    """Spectra and impedances alone: an error that says so."""
    with pytest.raises(ValueError, match="no periodic recording"):
        recordings_to_diagnose([recording("z", "healthy", kind="input_impedance")])
