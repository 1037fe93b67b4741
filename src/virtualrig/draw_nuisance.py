"""Nuisance physics of a population's rigs: what every real bench has and no data sheet states.

Orders of magnitude are those of the literature or of the estimate that is stated, not those of the
diagnosed tool's priors. Every rig has all of them. How they enter the rig is in
`virtualrig.nuisance`.
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Range:
    """A quantity drawn between `low` and `high`; `scale` is "uniform", "log" or "signed".

    A "signed" one is uniform in size, and either sign is as likely.
    """

    low: float
    high: float
    unit: str
    scale: str
    what: str
    source: str

    def draw(self, rng: np.random.Generator) -> float:
        if self.scale == "log":
            return float(self.low * (self.high / self.low) ** rng.uniform())
        size = float(rng.uniform(self.low, self.high))
        return size * float(rng.choice([-1.0, 1.0])) if self.scale == "signed" else size


NUISANCE = {
    "dead_volume": Range(0.04, 0.15, "relative", "signed", "pump: dead volume",
        "estimate: drawings state strokes; cavities of pistons and ports are 0.1 of the volume"),
    "port_area": Range(0.03, 0.10, "relative", "signed", "pump: port area",
        "estimate: cast edges and chamfers of 0.3 mm on ports 10 mm wide"),
    "discharge_coefficient": Range(0.60, 0.75, "", "uniform", "pump: discharge coefficient",
        "Merritt 1967: 0.61 for a sharp edge, more for short bores"),
    "bulk_modulus": Range(0.03, 0.10, "relative", "signed", "pump: bulk modulus",
        "Gholizadeh, Burton and Schoenau 2011"),
    "timing_deg": Range(0.1, 0.5, "deg", "signed", "pump: valve plate turned",
        "estimate: a pin 0.05 to 0.2 mm off at a radius of 25 mm"),
    "case_leakage": Range(0.5, 2.0, "times", "log", "pump: leakage of a chamber",
        "Bergada et al. 2012: cube of a clearance known to some 20 %"),
    "air": Range(1e-3, 1e-2, "of volume", "log", "pump: free air in the chambers at one atmosphere",
        "Gholizadeh, Burton and Schoenau 2011"),
    "groove_deg": Range(3.0, 8.0, "deg", "uniform", "ports: triangular relief groove",
        "Manring 2003"),
    "groove_share": Range(0.02, 0.08, "of port area", "log", "ports: greatest area of the groove",
        "Manring 2003"),
    "bore_spread": Range(1e-4, 1e-3, "relative", "log", "pistons: standard deviation of bore area",
        "ISO 286: IT6 to IT7 of a 15 mm bore"),
    "angle_spread_deg": Range(0.005, 0.03, "deg", "log", "pistons: standard deviation of angle",
        "estimate: bores placed within 2 to 15 um at a radius of 30 mm"),
    "speed_ripple": Range(5e-5, 5e-4, "relative", "log", "shaft: speed once a revolution",
        "estimate: a coupling 5 to 50 um off centre at 100 mm"),
    "wall_compliance": Range(2e-3, 2e-2, "relative", "log", "line: retarded compliance of the wall",
        "estimate: a tenth of hoses' (Johnston, Way and Cone 2010)"),
    "wall_time": Range(1e-4, 1e-3, "s", "log", "line: retardation time of the wall",
        "Johnston, Way and Cone 2010"),
    "temperature_drop": Range(0.3, 3.0, "K", "log", "line: warmer at the pump than at the load",
        "estimate: 8 to 25 W/(m2 K) from a bare line 40 K above the air, 10 to 60 l/min"),
    "cavity": Range(5e-8, 5e-7, "m3", "log", "sensors: volume of the adapter, each",
        "estimate: bores of adapters; ISO 10767-1:2015 asks for flush sensors"),
    "cavity_hz": Range(4e3, 2e4, "Hz", "log", "sensors: resonance of passage and cavity, each",
        "estimate: Helmholtz, a passage of 2 mm, 20 mm long, before the cavity"),
    "cavity_damping": Range(0.03, 0.3, "", "log", "sensors: damping ratio of it",
        "estimate: laminar friction (Zielke 1968) in passages of 1 to 3 mm"),
    "gain": Range(0.0, 5e-3, "relative", "signed", "sensors: error of the gain, each",
        "data sheets of industrial transmitters: 0.25 to 0.5 % of span"),
    "offset": Range(2e4, 1e5, "Pa", "signed", "sensors: offset, each",
        "data sheets: 0.1 to 0.4 % of 25 MPa"),
    "drift": Range(5e2, 1e4, "Pa", "log", "sensors: drift within a recording",
        "data sheets: 0.02 % of span a kelvin"),
    "noise": Range(5e2, 4e3, "Pa rms", "log", "noise of each sensor",
        "data sheets: 0.002 to 0.016 % of 25 MPa"),
    "corner_hz": Range(20.0, 400.0, "Hz", "log", "noise: 1/f below", "Keshner 1982"),
    "scatter": Range(1e-3, 5e-3, "relative", "log", "ripple: scatter from revolution to revolution",
        "estimate; random share of cyclostationary signals (Antoni 2009)"),
    "wander": Range(1e-4, 8e-4, "relative", "log", "speed: slow wander within a recording",
        "estimate: slip of induction motors with mains and load"),
    "session_kelvin": Range(0.5, 2.5, "K", "signed", "state: warmer or colder than when healthy",
        "0.3 % of wave speed and 4 % of viscosity a kelvin (Gholizadeh et al. 2011; ASTM D341)"),
    "wall_factor": Range(0.7, 1.4, "of the line's", "log", "line: wall compliance of a segment",
        "estimate: seals and clamps of one line differ by a third"),
    "laminar": Range(0.1, 0.6, "of the flow", "uniform", "leaks: laminar share",
        "McCandlish and Dorey 1984; Bergada et al. 2010"),
}  # fmt: skip

RECORDING_KELVIN = 0.4  # standard deviation of the temperature from recording to recording
LOAD_ERROR = 0.005  # relative standard deviation of the load pressure that the operator sets
SPEED_ERROR = 0.001
EACH_SENSOR = ("cavity", "cavity_hz", "cavity_damping", "gain", "offset")
EACH_SEGMENT = ("wall_factor",)


def draw_nuisance(rng: np.random.Generator, sensors: int, segments: int) -> dict:
    """A value of every quantity of NUISANCE but `laminar`; of EACH_SENSOR and EACH_SEGMENT a
    list."""
    counts = dict.fromkeys(EACH_SENSOR, sensors) | dict.fromkeys(EACH_SEGMENT, segments)
    return {
        name: [given.draw(rng) for _ in range(counts[name])] if name in counts else given.draw(rng)
        for name, given in NUISANCE.items()
        if name != "laminar"
    }
