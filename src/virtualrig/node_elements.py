"""Elements at the nodes where pipes meet: volumes, gas, leaks, orifices, side arms, valves.

Each is implicit in time. The outgoing waves of the pipes and the elements determine the pressure of
a node together, so no volume is lost.
"""

from virtualrig.compilation import step_function
from virtualrig.pump import ATMOSPHERE, orifice_flow

# columns of the node table; flows leave the node, pressures in Pa
(
    VOLUME,  # compliance of a volume, m3/Pa
    GAS_VOLUME,  # accumulator: volume at absolute GAS_PRESSURE, polytropic exponent GAS_EXPONENT
    GAS_PRESSURE,
    GAS_EXPONENT,
    LEAK,  # conductance to the tank, m3/s/Pa
    ORIFICE,  # square-law orifice to the tank, m3/s/Pa^0.5
    TANK,  # pressure behind LEAK, Pa
    ARM_INERTANCE,  # series inertance, resistance, stiffness (1/compliance) of a resonant side arm
    ARM_RESISTANCE,
    ARM_STIFFNESS,
    VALVE_GAIN,  # orifice opening 1 + y with y''/w^2 + y' VALVE_LAG + y = gain (p/VALVE_SET - 1)
    VALVE_INERTIA,  # 1/w^2, s2
    VALVE_LAG,  # s
    VALVE_SET,
    NODE_COLUMNS,
) = range(15)
# rows of a node's state: stored volume, arm flow, arm volume, valve opening, valve speed
STORED, ARM_FLOW, ARM_VOLUME, VALVE, VALVE_SPEED, NODE_STATES = range(6)


@step_function
def settle_node(table, history, state, lead, wave_in, wave_lead, guess):
    """Pressure of one node, Pa, at which the flow of the waves passes through its elements.

    `table` is the node's row of the node table, `history` the past's part of its states over the
    time step, `state` its states, which are updated, `lead` is LEAD/dt. The waves carry
    wave_in - wave_lead p, m3/s. Newton's method starts at `guess`.
    """
    arm = table[ARM_INERTANCE] > 0
    valve = table[VALVE_GAIN] != 0
    # implicit side arm: flow = arm_0 + arm_1 p;  implicit valve: opening = open_0 + open_1 p
    arm_0 = arm_1 = open_1 = 0.0
    open_0 = 1.0
    if arm:
        inertia = table[ARM_INERTANCE] * lead + table[ARM_RESISTANCE] + table[ARM_STIFFNESS] / lead
        arm_0 = table[ARM_INERTANCE] * history[ARM_FLOW]
        arm_0 = (arm_0 - table[ARM_STIFFNESS] / lead * history[ARM_VOLUME]) / inertia
        arm_1 = 1 / inertia
    if valve:
        stiff = table[VALVE_INERTIA] * lead * lead + table[VALVE_LAG] * lead + 1
        open_0 = table[VALVE_INERTIA] * (lead * history[VALVE] + history[VALVE_SPEED])
        open_0 = (open_0 + table[VALVE_LAG] * history[VALVE] - table[VALVE_GAIN]) / stiff
        open_1 = table[VALVE_GAIN] / table[VALVE_SET] / stiff
        open_0 += 1
    p = guess
    for _ in range(50):
        stored, compliance = table[VOLUME] * p, table[VOLUME]
        if table[GAS_VOLUME] > 0:
            absolute = p + ATMOSPHERE
            gas = table[GAS_VOLUME] * (table[GAS_PRESSURE] / absolute) ** (1 / table[GAS_EXPONENT])
            stored -= gas
            compliance += gas / (absolute * table[GAS_EXPONENT])
        root = slope = 0.0
        if table[ORIFICE] != 0:
            root, slope = orifice_flow(p, 1e3)
        opening = open_0 + open_1 * p
        out = table[LEAK] * (p - table[TANK]) + table[ORIFICE] * opening * root
        out += arm_0 + arm_1 * p + lead * stored - history[STORED]
        tangent = table[LEAK] + table[ORIFICE] * (opening * slope + open_1 * root)
        tangent += arm_1 + lead * compliance + wave_lead
        change = (wave_in - wave_lead * p - out) / tangent
        p += change
        if abs(change) < 1e-3:
            break
    state[STORED] = table[VOLUME] * p
    if table[GAS_VOLUME] > 0:
        ratio = table[GAS_PRESSURE] / (p + ATMOSPHERE)
        state[STORED] -= table[GAS_VOLUME] * ratio ** (1 / table[GAS_EXPONENT])
    state[ARM_FLOW] = arm_0 + arm_1 * p
    state[ARM_VOLUME] = (history[ARM_VOLUME] + state[ARM_FLOW]) / lead
    state[VALVE] = open_0 + open_1 * p - 1
    state[VALVE_SPEED] = lead * state[VALVE] - history[VALVE]
    return p
