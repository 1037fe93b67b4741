"""Nuisance physics of a population's rigs: what every real bench has and no data sheet states.

Sizes are those of the literature, not those of the diagnosed tool's priors. Every rig has all of
them. How they enter the rig is in `virtualrig.nuisance`.
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
        "Ivantysyn and Ivantysynova 2001: porting and piston cavities are rarely on a drawing"),
    "port_area": Range(0.03, 0.10, "relative", "signed", "pump: port area",
        "Edge and Darling 1989"),
    "discharge_coefficient": Range(0.60, 0.75, "", "uniform", "pump: discharge coefficient",
        "Merritt 1967: 0.61 for a sharp edge, more for short bores"),
    "bulk_modulus": Range(0.03, 0.10, "relative", "signed", "pump: bulk modulus",
        "Gholizadeh, Burton and Schoenau 2011"),
    "timing_deg": Range(0.1, 0.5, "deg", "signed", "pump: valve plate turned",
        "Manring 2003: indexing of valve plates"),
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
        "ISO 286: position of bores within 5 to 20 um"),
    "speed_ripple": Range(5e-5, 5e-4, "relative", "log", "shaft: speed once a revolution",
        "Edge and Darling 1989: shaft misalignment"),
    "wall_compliance": Range(2e-3, 2e-2, "relative", "log", "line: retarded compliance of the wall",
        "Johnston, Way and Cone 2010: hoses have ten times as much"),
    "wall_time": Range(1e-4, 1e-3, "s", "log", "line: retardation time of the wall",
        "Johnston, Way and Cone 2010"),
    "temperature_drop": Range(1.0, 6.0, "K", "uniform", "line: warmer at the pump than at the load",
        "Merritt 1967: natural convection from a bare line"),
    "cavity": Range(5e-8, 5e-7, "m3", "log", "sensors: volume of the adapter, each",
        "ISO 10767-1:2015 asks for flush sensors"),
    "cavity_hz": Range(4e3, 2e4, "Hz", "log", "sensors: resonance of passage and cavity, each",
        "ISO 10767-1:2015"),
    "cavity_damping": Range(0.03, 0.3, "", "log", "sensors: damping ratio of it", "Zielke 1968"),
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
        "Antoni 2009: random share of cyclostationary signals"),
    "wander": Range(1e-4, 8e-4, "relative", "log", "speed: slow wander within a recording",
        "slip of induction motors with mains and load"),
    "session_kelvin": Range(0.5, 2.5, "K", "signed", "state: warmer or colder than when healthy",
        "0.3 % of wave speed and 4 % of viscosity a kelvin (Gholizadeh et al. 2011; ASTM D341)"),
    "laminar": Range(0.1, 0.6, "of the flow", "uniform", "leaks: laminar share",
        "McCandlish and Dorey 1984; Bergada et al. 2010"),
}  # fmt: skip

RECORDING_KELVIN = 0.4  # standard deviation of the temperature from recording to recording
LOAD_ERROR = 0.005  # relative standard deviation of the load pressure that the operator sets
SPEED_ERROR = 0.001
EACH_SENSOR = ("cavity", "cavity_hz", "cavity_damping", "gain", "offset")


def draw_nuisance(rng: np.random.Generator, sensors: int) -> dict:
    """A value of every quantity of NUISANCE but `laminar`; of EACH_SENSOR a list."""
    return {
        name: [given.draw(rng) for _ in range(sensors)] if name in EACH_SENSOR else given.draw(rng)
        for name, given in NUISANCE.items()
        if name != "laminar"
    }
