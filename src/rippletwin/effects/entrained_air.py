"""Free air in the oil: a compressibility that falls with the mean pressure.

At one mean pressure it is a slower wave and nothing else; at two it gives itself away.
"""

from __future__ import annotations

from rippletwin.effects.base import Effect, Parameter, line_place, lognormal, normal

ATMOSPHERE = 1.01325e5  # Pa


def air_compressibility(gas_fraction, exponent, mean_pressure):
    """Added compressibility alpha (p_atm/p)^(1/n)/(n p), 1/Pa, of free air.

    `gas_fraction` alpha is by volume at atmospheric pressure, `exponent` n the polytropic one.
    """
    return (
        gas_fraction * (ATMOSPHERE / mean_pressure) ** (1.0 / exponent) / (exponent * mean_pressure)
    )


def _apply(network, line, values, place):
    added = network.s * air_compressibility(
        values["gas_fraction"], values["polytropic_exponent"], line.mean_pressure
    )
    for k in range(len(line.diameters)):
        network.shunt[k] = network.shunt[k] + line.area(k) * added


def _in_time(line, state, values, place):
    # As compressible without delay as the oil itself: a slower wave.
    added = air_compressibility(
        values["gas_fraction"], values["polytropic_exponent"], state.mean_pressure
    )
    for k, pipe in enumerate(line.pipes):
        line.pipes[k] = pipe.softened(added * state.density * pipe.wave_speed**2)


EFFECT = Effect(
    name="entrained_air",
    element="line",
    medium="liquid",
    equation="Y' = A s (1/(rho a^2) + alpha (p_atm/p)^(1/n)/(n p))",
    source="Wylie & Streeter 1993, Fluid Transients in Systems, sec. 1.4; "
    "Merritt 1967, Hydraulic Control Systems, eq. 2-11",
    parameters=lambda rig, place: (
        Parameter("gas_fraction", "1", lognormal(5e-3, 1.2)),
        Parameter("polytropic_exponent", "1", normal(1.2, 0.12)),
    ),
    places=line_place,
    apply=_apply,
    in_time=_in_time,
)
