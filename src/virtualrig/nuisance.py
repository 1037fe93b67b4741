"""The true rig of a population: a data sheet, its true line and its nuisance physics.

A rig has a state: how many kelvin it is warmer than on average. Wave speeds, viscosity and the bulk
modulus in the pump follow from it.
"""

from itertools import pairwise

import numpy as np

WAVE_SPEED_PER_KELVIN = -0.003  # relative; Gholizadeh, Burton, Schoenau, Int. J. Fluid Power 2011
VISCOSITY_PER_KELVIN = -0.04  # relative, ISO VG 46 about 50 degrees C (ASTM D341)
MODULUS_PER_KELVIN = 2 * WAVE_SPEED_PER_KELVIN  # that of rho a^2
LONGEST_PIECE = 0.8  # m; within a piece the temperature is one
NUMERICS = {"frequency": 5000.0, "points": 6.0, "degree": 6}


def seal_at(
    sheet: dict, true: dict, nuisance: dict, kelvin: float = 0.0, numerics: dict | None = None
) -> dict:
    """The seal (`virtualrig.rig.build`) of the rig when it is `kelvin` warmer than on average.

    `true` has fluid, line and sensors as the seal has them. It may have branches, a list of
    arguments of the effect `side_branch`, and `effects`, entries of a seal, which come last: they
    replace what the nuisance physics says of the same sensor.
    """
    compliance, time = nuisance["wall_compliance"], nuisance["wall_time"]
    walled = [
        {"wall": (compliance * factor, time)} | segment
        for factor, segment in zip(nuisance["wall_factor"], true["line"]["segments"], strict=True)
    ]
    segments = cut_with_gradient(
        walled,
        fitted_positions(true),
        true["fluid"]["kinematic_viscosity"],
        nuisance["temperature_drop"],
        kelvin,
    )
    effects = [{"name": "unsteady_friction"}]
    for k, position in enumerate(true["sensors"]):
        effects += [
            {"name": "line_volume", "position": position, "volume": nuisance["cavity"][k]},
            {"name": "sensor_gain", "sensor": k + 1, "gain": 1 + nuisance["gain"][k]},
            {
                "name": "sensor_dynamics",
                "sensor": k + 1,
                "frequency_hz": nuisance["cavity_hz"][k],
                "damping": nuisance["cavity_damping"][k],
            },
        ]
    effects += [{"name": "side_branch", **branch} for branch in true.get("branches", [])]
    effects += [
        {
            "name": "piston_spread",
            "bore_area": nuisance["bore_spread"],
            "case_leakage": 0.2,
            "angle_deg": nuisance["angle_spread_deg"],
            "seed": true["seed"],
        },
        {"name": "speed_fluctuation", "order": 1, "amplitude": nuisance["speed_ripple"]},
        *true.get("effects", []),
    ]
    return {
        "fluid": true["fluid"],
        "pump": {"values": true_pump(sheet["pump"], nuisance, kelvin)},
        "line": {"segments": segments},
        "sensors": true["sensors"],
        "effects": effects,
        "numerics": numerics or NUMERICS,
    }


def fitted_positions(true: dict) -> list[float]:
    """Where sensors, branches and effects sit on the line, m from the pump."""
    fitted = [*true.get("branches", []), *true.get("effects", [])]
    return [*true["sensors"], *(each["position"] for each in fitted if "position" in each)]


def true_pump(known: dict, nuisance: dict, kelvin: float = 0.0) -> dict:
    """Values of the true pump that differ from the data sheet's.

    Where a groove opens ahead of a port, the port itself opens later: the chamber is shut off over
    the angle that the sheet states, and open after it.
    """
    groove = nuisance["groove_deg"]
    return {
        "dead_volume": known["dead_volume"] * (1 + nuisance["dead_volume"]),
        "port_area": known["port_area"] * (1 + nuisance["port_area"]),
        "discharge_coefficient": nuisance["discharge_coefficient"],
        "bulk_modulus": known["bulk_modulus"]
        * (1 + nuisance["bulk_modulus"])
        * (1 + MODULUS_PER_KELVIN * kelvin),
        "case_leakage": known["case_leakage"] * nuisance["case_leakage"],
        "port_timing_deg": nuisance["timing_deg"],
        "port_overlap_deg": known["port_overlap_deg"] + 2 * groove,
        "port_opening_deg": max(known["port_opening_deg"] - groove, 4.0),
        "groove_deg": groove,
        "groove_share": nuisance["groove_share"],
        "air": nuisance["air"],
    }


def cut_with_gradient(
    segments: list[dict], fitted: list[float], viscosity: float, drop: float, kelvin: float
) -> list[dict]:
    """The segments cut where something is fitted, and into pieces, each at its own temperature.

    The network has a node at every fitting in any case. A cut anywhere near one would leave a pipe
    so short that it needs tiny time steps.

    The temperature falls by `drop`, K, evenly from pump to load and is `kelvin` above average in
    the middle.
    """
    ends = np.concatenate([[0.0], np.cumsum([s["length"] for s in segments])])
    pieces = []
    for k, segment in enumerate(segments):
        inside = sorted(x for x in fitted if ends[k] < x < ends[k + 1])
        joints = [ends[k], *inside, ends[k + 1]]
        for start, stop in pairwise(joints):
            count = int(np.ceil((stop - start) / LONGEST_PIECE))
            edges = np.linspace(start, stop, count + 1)
            for a, b in pairwise(edges):
                warmer = kelvin + drop * (0.5 - 0.5 * (a + b) / ends[-1])
                speed = segment["wave_speed"] * (1 + WAVE_SPEED_PER_KELVIN * warmer)
                thickness = viscosity * float(np.exp(VISCOSITY_PER_KELVIN * warmer))
                piece = {"length": float(b - a), "wave_speed": float(speed), "viscosity": thickness}
                pieces.append(segment | piece)
    return pieces


def segments_as_recorded(segments: list[dict], drop: float, kelvin: float) -> list[dict]:
    """The segments at the wave speed of their own mean temperature.

    It falls by `drop`, K, evenly from pump to load and is `kelvin` above average in the middle.
    """
    ends = np.concatenate([[0.0], np.cumsum([s["length"] for s in segments])])
    warmer = kelvin + drop * (0.5 - 0.5 * (ends[:-1] + ends[1:]) / ends[-1])
    return [
        segment | {"wave_speed": float(segment["wave_speed"] * (1 + WAVE_SPEED_PER_KELVIN * t))}
        for segment, t in zip(segments, warmer)
    ]
