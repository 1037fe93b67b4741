"""Axial piston pump of the virtual rig: chambers of a compressible liquid between two ports.

Crank angle is zero where a piston is furthest out; a chamber then shrinks, and delivers, for half a
turn. Around both dead centres a chamber is shut off for `port_overlap_deg`, or open to both ports
where that is negative; from there the port in question opens to its whole area over
`port_opening_deg`, and closes the same way.

Free air makes the chambers' liquid softer at low pressure. A chamber's state is its compression
e(p) = p + B f (1 - (p0/p)^(1/n)), absolute p, that of a liquid of modulus B with a volume fraction
f of gas at the pressure p0 of the atmosphere (Merritt, Hydraulic Control Systems, 1967, section
2.4).
"""

from dataclasses import dataclass, field, replace

import numpy as np
from numba import njit

from virtualrig.compilation import step_function
from virtualrig.elimination import eliminate, eliminate_arrow

# columns of the chamber table
(
    BORE, STROKE_RADIUS, DEAD_VOLUME, ANGLE, CASE_LEAK, SLIPPER, NEIGHBOUR,
    NEIGHBOUR_GAP,  # laminar part of the leak to the neighbour, m3/s/Pa
    INLET,  # share of the suction port that is not blocked
    CHAMBER_COLUMNS,
) = range(10)  # fmt: skip
MOST_NEWTON_STEPS = 30
# entries of the port table
(
    AREA, OPENING, OVERLAP, TIMING, ORIFICE, MODULUS, SUCTION, LAMINAR,
    GROOVE,  # crank angle, rad, over which a relief groove opens ahead of the port
    GROOVE_SHARE,  # greatest area of the groove, of the port's
    AIR,  # bulk modulus times the volume fraction of free air at one atmosphere, Pa
    WEAR,  # orifice coefficient of a worn sealing land about the dead centres, m3/s/Pa^0.5
    PORT_ENTRIES,
) = range(13)  # fmt: skip
ATMOSPHERE = 1.01325e5  # Pa; all pressures are gauge pressures, unless called absolute
AIR_EXPONENT = 1.2  # polytropic
LEAST_PRESSURE = 2e3  # absolute, Pa: below, vapour fills the room and the pressure hardly falls
WORN_ANGLE = np.radians(15.0)  # from a dead centre, to which a worn land connects both ports


@dataclass(frozen=True)
class Pump:
    """Geometry of an axial piston pump (SI units; angles in degrees of crank angle).

    `case_leakage` is laminar, m3/s/Pa a chamber; `port_timing_deg` turns the port plate.
    `spread` (pistons, 3) are each piston's relative deviations of bore area and case leakage, and
    its deviation of angular position in degrees. With `groove_deg` a triangular relief groove opens
    each port that much earlier, to the share `groove_share` of its area; the port then opens as two
    circles overlap. `air` is the volume fraction of free air in the chambers at one atmosphere.
    """

    pistons: int = 9
    piston_diameter: float = 0.017
    pitch_radius: float = 0.0335
    swash_angle_deg: float = 17.0
    dead_volume: float = 1.5e-6
    bulk_modulus: float = 1.3e9
    port_area: float = 1.1e-4
    port_opening_deg: float = 30.0
    port_overlap_deg: float = 2.0
    discharge_coefficient: float = 0.65
    case_leakage: float = 3e-13
    suction_pressure: float = 2e5
    port_timing_deg: float = 0.0
    groove_deg: float = 0.0
    groove_share: float = 0.0
    air: float = 0.0
    spread: np.ndarray | None = field(default=None, repr=False)

    @property
    def displacement(self) -> float:
        """Volume displaced a revolution, m3."""
        stroke = 2 * self.pitch_radius * np.tan(np.radians(self.swash_angle_deg))
        return self.pistons * np.pi / 4 * self.piston_diameter**2 * stroke

    def changed(self, relative: dict[str, float], timing_deg: float = 0.0) -> "Pump":
        """This pump with some values changed by a relative amount and the port plate turned."""
        values = {name: getattr(self, name) * (1 + by) for name, by in relative.items()}
        return replace(self, port_timing_deg=self.port_timing_deg + timing_deg, **values)

    def with_spread(self, spread: np.ndarray) -> "Pump":
        """This pump with further deviations (pistons, 3) from piston to piston."""
        return replace(self, spread=spread if self.spread is None else self.spread + spread)


def pump_tables(pump: Pump, density: float, faults: tuple = ()):
    """Tables for the time stepper: (pistons, CHAMBER_COLUMNS) and (PORT_ENTRIES,).

    `faults` are those of `virtualrig.faults`.
    """
    spread = np.zeros((pump.pistons, 3)) if pump.spread is None else np.asarray(pump.spread)
    orifice = pump.discharge_coefficient * np.sqrt(2 / density)
    chambers = np.zeros((pump.pistons, CHAMBER_COLUMNS))
    chambers[:, BORE] = np.pi / 4 * pump.piston_diameter**2 * (1 + spread[:, 0])
    chambers[:, STROKE_RADIUS] = pump.pitch_radius * np.tan(np.radians(pump.swash_angle_deg))
    chambers[:, DEAD_VOLUME] = pump.dead_volume
    step = 2 * np.pi / pump.pistons
    chambers[:, ANGLE] = step * np.arange(pump.pistons) + np.radians(spread[:, 2])
    chambers[:, CASE_LEAK] = pump.case_leakage * (1 + spread[:, 1])
    chambers[:, INLET] = 1.0
    ports = np.zeros(PORT_ENTRIES)
    ports[AREA] = pump.port_area
    ports[OPENING] = np.radians(pump.port_opening_deg)
    ports[OVERLAP] = np.radians(pump.port_overlap_deg)
    ports[TIMING] = np.radians(pump.port_timing_deg)
    ports[ORIFICE] = orifice
    ports[MODULUS] = pump.bulk_modulus
    ports[SUCTION] = pump.suction_pressure
    ports[LAMINAR] = 2e3
    ports[GROOVE] = np.radians(pump.groove_deg)
    ports[GROOVE_SHARE] = pump.groove_share
    ports[AIR] = pump.bulk_modulus * pump.air
    for fault in faults:
        fault.apply(chambers, ports)
    return chambers, ports


@njit(cache=True)
def orifice_flow(drop, laminar):
    """Square-root orifice, linear below about `laminar` Pa: drop/(drop^2 + laminar^2)^(1/4),
    slope.
    """
    square = drop * drop
    shifted = square + laminar * laminar
    root = np.sqrt(np.sqrt(shifted))
    return drop / root, (0.5 * square + laminar * laminar) / (shifted * root)


@njit(cache=True)
def port_opening(angle, ports):
    """Share (0 to 1) of the area of the delivery port open at crank angle `angle`, rad.

    The suction port is the same half a turn later.
    """
    from_centre = (angle - ports[TIMING]) % (2 * np.pi)
    if from_centre >= 1.5 * np.pi:  # the dead centre is ahead, and the port may open before it
        from_centre -= 2 * np.pi
    from_start = from_centre - 0.5 * ports[OVERLAP]
    to_end = np.pi - ports[OVERLAP] - from_start
    if ports[GROOVE] > 0:
        return _grooved_opening(min(from_start, to_end), ports)
    x = min(from_start, to_end) / ports[OPENING]
    if x <= 0:
        return 0.0
    if x >= 1:
        return 1.0
    return x * x * (3 - 2 * x)


@njit(cache=True)
def _grooved_opening(beyond, ports):
    """The same, `beyond` rad from where the port itself starts to open, with a relief groove.

    The cross section of a triangular groove grows with the square of its length (Manring, J. Mech.
    Des. 125, 2003). The port's edge and the chamber's are circles: the lens that they
    have in common is the open area.
    """
    groove = min(max(beyond / ports[GROOVE] + 1.0, 0.0), 1.0)
    x = min(max(beyond / ports[OPENING], 0.0), 1.0)
    lens = 2 * (np.arccos(1 - x) - (1 - x) * np.sqrt(x * (2 - x))) / np.pi
    return max(ports[GROOVE_SHARE] * groove * groove, lens)


@njit(cache=True)
def _worn_opening(angle, ports):
    """Orifice coefficient from a chamber to either port over a worn land, at `angle`, rad."""
    off = abs((angle - ports[TIMING] + 0.5 * np.pi) % np.pi - 0.5 * np.pi) / WORN_ANGLE
    return ports[WEAR] * (1 - off * off) if off < 1 else 0.0


@njit(cache=True)
def compression(pressure, ports):
    """A chamber's compression e(p), Pa, at a gauge pressure in Pa, and its slope."""
    if ports[AIR] == 0:
        return pressure, 1.0
    absolute = max(pressure + ATMOSPHERE, LEAST_PRESSURE)
    gas = ports[AIR] * (ATMOSPHERE / absolute) ** (1 / AIR_EXPONENT)
    slope = 1 + gas / (AIR_EXPONENT * absolute)
    below = pressure + ATMOSPHERE - absolute
    return absolute - ATMOSPHERE + ports[AIR] - gas + slope * below, slope


@step_function
def chamber_kinematics(angle, speed, chambers, ports, stations):
    """Write what depends on the crank angle alone into `stations` (pistons, 4).

    Its columns are bulk modulus over volume, displaced flow, and the orifice coefficients of
    delivery and suction port.
    """
    full = ports[ORIFICE] * ports[AREA]
    for i in range(len(chambers)):
        phi = angle + chambers[i, ANGLE]
        swept = chambers[i, BORE] * chambers[i, STROKE_RADIUS]
        volume = chambers[i, DEAD_VOLUME] + swept * (1 + np.cos(phi))
        stations[i, 0] = ports[MODULUS] / volume
        stations[i, 1] = swept * np.sin(phi) * speed
        stations[i, 2] = full * port_opening(phi, ports)
        stations[i, 3] = full * port_opening(phi + np.pi, ports) * chambers[i, INLET]
        if ports[WEAR] > 0:
            worn = _worn_opening(phi, ports)
            stations[i, 2] += worn
            stations[i, 3] += worn


@step_function
def compress_all(pressures, ports, squeezed):
    """Write the chambers' compression at their `pressures`, and its slope: (pistons, 2)."""
    for i in range(len(squeezed)):
        squeezed[i, 0], squeezed[i, 1] = compression(pressures[i], ports)


@njit(cache=True)
def step_chambers(stations, history, lead, chambers, ports, outlet_lead, outlet_rest, x, matrix):
    """One implicit step of all chambers and of the outlet that they share; returns Newton steps.

    Solves lead e(p_i) - history_i = de_i/dt for the chambers' compression and
    outlet_lead p - outlet_rest = sum of delivered flows for the outlet pressure, by Newton's
    method. `x` (pistons + 1,) holds the chamber pressures and the outlet pressure: start values
    in, solution out. `stations` are those of `chamber_kinematics`; `matrix` (pistons + 1,
    pistons + 2) is workspace.
    """
    squeezed = np.empty((len(chambers), 2))
    compress_all(x, ports, squeezed)
    return solve_chambers(
        stations, history, lead, chambers, ports, outlet_lead, outlet_rest, x, matrix, squeezed
    )


@step_function
def solve_chambers(
    stations, history, lead, chambers, ports, outlet_lead, outlet_rest, x, matrix, squeezed
):
    """`step_chambers` with `squeezed` (pistons, 2), `compress_all` at `x`: so in, and so out."""
    n = len(chambers)
    laminar = ports[LAMINAR]
    coupled = False
    for i in range(n):
        coupled |= chambers[i, NEIGHBOUR] > 0 or chambers[i, NEIGHBOUR_GAP] > 0
    for iteration in range(MOST_NEWTON_STEPS):
        matrix[:] = 0.0
        matrix[n, n] = outlet_lead
        matrix[n, n + 1] = outlet_rest - outlet_lead * x[n]
        for i in range(n):
            stiffness, gain, opening, inlet = stations[i]
            strain, softness = squeezed[i, 0], squeezed[i, 1]
            slope = chambers[i, CASE_LEAK]
            gain -= slope * x[i]
            if chambers[i, SLIPPER] > 0:
                leak, tangent = orifice_flow(x[i], laminar)
                gain -= chambers[i, SLIPPER] * leak
                slope += chambers[i, SLIPPER] * tangent
            if inlet > 0:
                suction, tangent = orifice_flow(ports[SUCTION] - x[i], laminar)
                gain += inlet * suction
                slope += inlet * tangent
            if opening > 0:
                delivery, tangent = orifice_flow(x[i] - x[n], laminar)
                gain -= opening * delivery
                slope += opening * tangent
                matrix[i, n] = -stiffness * opening * tangent
                matrix[n, i] = -opening * tangent
                matrix[n, n] += opening * tangent
                matrix[n, n + 1] += opening * delivery
            matrix[i, n + 1] += history[i] - lead * strain + stiffness * gain
            matrix[i, i] += lead * softness + stiffness * slope
            if chambers[i, NEIGHBOUR] > 0 or chambers[i, NEIGHBOUR_GAP] > 0:
                k = (i + 1) % n
                across, tangent = orifice_flow(x[i] - x[k], laminar)
                across *= chambers[i, NEIGHBOUR]
                tangent *= chambers[i, NEIGHBOUR]
                across += chambers[i, NEIGHBOUR_GAP] * (x[i] - x[k])
                tangent += chambers[i, NEIGHBOUR_GAP]
                matrix[i, n + 1] -= stiffness * across
                matrix[i, i] += stiffness * tangent
                matrix[i, k] -= stiffness * tangent
                matrix[k, n + 1] += stations[k, 0] * across
                matrix[k, k] += stations[k, 0] * tangent
                matrix[k, i] -= stations[k, 0] * tangent
        if coupled:
            eliminate(matrix)
        else:
            eliminate_arrow(matrix)
        largest = 0.0
        # near zero pressure drop a square-root orifice makes Newton's method oscillate: halve
        # every other step
        damping = 0.5 if iteration > 4 and iteration % 2 == 1 else 1.0
        for i in range(n + 1):
            x[i] += damping * matrix[i, n + 1]
            largest = max(largest, abs(matrix[i, n + 1]))
        compress_all(x, ports, squeezed)
        if largest < 1.0:
            return iteration + 1
    return MOST_NEWTON_STEPS + 1
