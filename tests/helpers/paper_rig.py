"""The paper's rig: its table of calibrated parameters, as in resources/paper_rig.yaml."""

from __future__ import annotations

from rippletwin.case.model import Fluid, Load, Rig, Segment, Sensor

PISTONS = 9
OIL = Fluid(density=870.0, kinematic_viscosity=3.2e-5)
SEGMENTS = (
    Segment(5.953, 0.01971, 1022.9),
    Segment(1.144, 0.02307, 982.7),
    Segment(1.675, 0.01486, 1308.4),
)
SENSORS = (0.4167, 2.5895)  # m from the pump


def paper_rig(sensors: int = 3, segments: int = 3, third_sensor: float = 7.5) -> Rig:
    """The first `segments` of the line with two sensors, or with one more at `third_sensor` (m)."""
    positions = (*SENSORS, third_sensor)[:sensors]
    return Rig(
        fluid=OIL,
        pump={"pistons": PISTONS},
        line=SEGMENTS[:segments],
        sensors=tuple(Sensor(f"p{k}", x) for k, x in enumerate(positions, 1)),
        load=Load("orifice"),
    )
