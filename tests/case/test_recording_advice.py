"""What recordings of a rig must have for an answer."""

from dataclasses import replace

from rippletwin.case.model import Fluid, Load, Rig, Segment, Sensor
from rippletwin.case.recording_advice import PlannedRecording, advise

LINE = (Segment(3.0, 0.02, 1020.0), Segment(1.5, 0.016, 1200.0))
SENSORS = (Sensor("p1", 0.4), Sensor("p2", 0.5), Sensor("p3", 2.1))
RIG = Rig(Fluid(870.0, 3.2e-5), {"pistons": 9}, LINE, SENSORS, Load("orifice"))


def planned(speed_rpm=1000.0, load_pressure=9.5e6, rate_hz=None, seconds=None):
    return PlannedRecording("healthy", speed_rpm, load_pressure, rate_hz, seconds)


def test_good_recordings_need_no_advice():
    """Two speeds, two pressures, three sensors and 10 kHz leave nothing to say."""
    recordings = [planned(1000.0, 9.5e6, 10e3, 10.0), planned(1200.0, 6e6, 10e3, 10.0)]
    assert advise(RIG, recordings) == []


def test_an_unknown_rate_is_advised():
    """Recordings that are only planned have no sampling rate yet."""
    (told,) = advise(RIG, [planned(1000.0, 9.5e6), planned(1200.0, 6e6)])
    assert told.startswith("Sample at 10 kHz or more")


def test_a_low_rate_ends_the_band():
    """At 2 kHz a nine-piston pump of 1000 r/min shows 800 Hz, five piston harmonics."""
    recordings = [planned(1000.0, 9.5e6, 2e3, 10.0), planned(1200.0, 6e6, 2e3, 10.0)]
    (told,) = advise(RIG, recordings)
    assert "ends the band at 800 Hz, 5 piston harmonics" in told


def test_a_line_without_a_pump_is_not_told_of_pumps():
    """Of a line excited by noise neither speeds nor a rate to sample at are advised: it has been
    recorded at 51.2 kHz."""
    noise = PlannedRecording("healthy", None, 0.0, 51.2e3, 10.0)
    assert advise(RIG, [noise]) == []
    (told,) = advise(replace(RIG, sensors=SENSORS[:2]), [noise])
    assert told.startswith("Two sensors")


def test_noise_at_a_stated_speed_is_no_ripple():
    """A recording of broadband noise may state a speed: it has no piston harmonics, and there may
    be no pump at all."""
    noise = PlannedRecording("healthy", 1000.0, 0.0, 2e3, 1.0, kind="random")
    assert advise(replace(RIG, pump={}), [noise]) == []
