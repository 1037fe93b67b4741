"""Effects at their places and the values that `synthetic_observations.make` gives them."""

from rippletwin.twin.effects.base import Place
from rippletwin.twin.effects.library import EFFECTS

VOLUME = ((EFFECTS["line_volume"], Place("position")),)
HOSE = ((EFFECTS["viscoelastic_wall"], Place("segment 2", 1)),)
GAIN = ((EFFECTS["sensor_gain"], Place("sensor p2", 1)),)
AIR = ((EFFECTS["entrained_air"], Place("line")),)
PASSAGE = ((EFFECTS["source_impedance"], Place("source", form="volume and passage")),)
LEAK = ((EFFECTS["leak"], Place("position")),)
TRUTH = {
    "line_volume@position.position": 4.4,
    "line_volume@position.volume": 6e-5,
    "viscoelastic_wall@segment 2.compliance_ratio": 0.2,
    "viscoelastic_wall@segment 2.retardation_time": 3e-4,
    "sensor_gain@sensor p2.gain_error": 0.08,
    "entrained_air@line.gas_fraction": 3e-3,
    "source_impedance@source.volume": 3e-5,
    "source_impedance@source.conductance": 4e-12,
    "source_impedance@source.inertance": 1e6,
    "leak@position.position": 5.0,
    "leak@position.conductance": 4e-11,
}
MUCH_AIR = TRUTH | {"entrained_air@line.gas_fraction": 8e-3}
