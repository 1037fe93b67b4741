"""An open side hole: against a third party's simulator, and against limits known by other means."""

import numpy as np
import pytest

from rippletwin.case.model import Fluid, Load, Rig, Segment
from rippletwin.spectra.observation import Observation
from rippletwin.twin.effects.base import Place
from rippletwin.twin.effects.library import EFFECTS
from rippletwin.twin.effects.side_hole import hole_impedance
from rippletwin.twin.parameters import coordinates
from rippletwin.twin.twin import Twin

LENGTH, DIAMETER = 0.2875, 4e-3
HOLE = {"position": 0.1, "diameter": 3e-3, "height": 1.7e-3}
FREQUENCY = np.linspace(100.0, 4000.0, 300)
LOSSES = ((EFFECTS["unsteady_friction"], Place("line")),
          (EFFECTS["thermal_boundary_layer"], Place("line")))  # fmt: skip
AIR = Fluid(1.2043, 1.507e-5, 1.402, 0.71)


def reflection(fluid, speed, effects, values):
    """R (F,) of the open tube with `effects`, their parameters at `values`, the end flanged."""
    rig = Rig(fluid, {}, (Segment(LENGTH, DIAMETER, speed),), (), Load("open"))
    observation = Observation(
        "input_impedance", "tube", FREQUENCY, None, np.ones((1, len(FREQUENCY)), complex),
        np.ones((len(FREQUENCY), 1, 1), complex), np.zeros(1), None, None, "known", None, (), True,
    )  # fmt: skip
    end = ((EFFECTS["end_radiation"], Place("load")),)
    twin = Twin(rig, [observation], friction="none", effects=(*effects, *end))
    named = {f"side_hole@position.{key}": value for key, value in values.items()}
    named["end_radiation@load.end_correction"] = 0.8217
    return twin.with_(theta=coordinates(twin.parameters, named)).predict([observation])[0][0]


@pytest.mark.parametrize("losses", [False, True])
def test_a_tube_with_a_hole_is_that_of_openwind(losses):
    """The reflection coefficient of a narrow tube with a hole agrees with openwind's, which has
    transfer matrices, a radiation of its own and a series mass at the hole, to 2 %; without the
    hole it is another."""
    openwind = pytest.importorskip("openwind")
    physics = openwind.continuous.Physics(20.0, humidity=0.0)
    rho, speed, mu, cp, kappa, gamma = physics.get_coefs(
        0.0, "rho", "c", "mu", "Cp", "kappa", "gamma"
    )
    fluid = Fluid(float(rho), float(mu / rho), float(gamma), float(mu * cp / kappa))
    result = openwind.ImpedanceComputation(
        FREQUENCY,
        [[0.0, LENGTH, 0.5 * DIAMETER, 0.5 * DIAMETER, "linear"]],
        [["label", "position", "length", "radius"], ["h", 0.1, 1.7e-3, 1.5e-3]],
        temperature=20.0,
        humidity=0.0,
        losses=losses,
        matching_volume=True,
        radiation_category="infinite_flanged",
        compute_method="TMM",
    )
    z = result.impedance / (result.Zc if np.max(np.abs(result.impedance)) > 1e5 else 1.0)
    theirs = (z - 1.0) / (z + 1.0)
    own = LOSSES if losses else ()
    hole = ((EFFECTS["side_hole"], Place("position")),)
    ours = reflection(fluid, float(speed), (*own, *hole), HOLE)
    without = reflection(fluid, float(speed), own, {})

    def off(r):
        return np.linalg.norm(r - theirs) / np.linalg.norm(theirs)

    print(f"losses {losses}: {off(ours):.2%}, without the hole {off(without):.0%}")
    assert off(ours) < 0.02
    assert off(without) > 0.5


def test_slow_flow_through_a_hole_is_poiseuilles():
    """At low frequency Z -> 8 mu h/(pi b^4) (Hagen-Poiseuille), and the mass is that of air as long
    as the hole and its two end corrections."""
    b, h, s = 1.5e-3, 1.7e-3, np.array([0.1j, 1e5j])
    z = hole_impedance(s, 2 * b, h, 0.1, 343.0, 1.2, 1.5e-5, "steady")
    poiseuille = 8.0 * 1.2 * 1.5e-5 * h / (np.pi * b**4)
    assert z[0].real == pytest.approx(poiseuille, rel=1e-3)
    z = hole_impedance(s, 2 * b, h, 0.1, 343.0, 1.2, 1.5e-5, "none")
    length = z[0].imag / 0.1 * np.pi * b**2 / 1.2
    # A wall that is flat on both sides: twice the flanged end's correction (Rayleigh 1896).
    assert length == pytest.approx(h + 2 * 0.82 * b, rel=0.01)


def test_a_small_source_radiates_as_much_whatever_its_size():
    """Re Z_r -> rho w^2/(2 pi c) of a source in a wall that is small against the wave (Rayleigh
    1896, sec. 302): without friction nothing else is real."""
    s = np.array([2j * np.pi * 500.0])
    for diameter in (1e-3, 2e-3, 4e-3):
        z = hole_impedance(s, diameter, 1e-3, 0.02, 343.0, 1.2, 1.5e-5, "none")
        assert z[0].real == pytest.approx(1.2 * np.abs(s[0]) ** 2 / (2 * np.pi * 343.0), rel=0.01)


def test_a_wide_hole_ends_the_tube_and_a_narrow_one_does_not():
    """A hole as wide as the bore shifts the reflection to the hole; one of a fiftieth of
    a millimetre leaves it."""
    hole = ((EFFECTS["side_hole"], Place("position")),)
    none = reflection(AIR, 343.0, (), {})
    narrow = reflection(AIR, 343.0, hole, HOLE | {"diameter": 2e-5})
    wide = reflection(AIR, 343.0, hole, HOLE | {"diameter": DIAMETER, "height": 1e-4})
    assert np.max(np.abs(narrow - none)) < 0.02
    low = FREQUENCY < 400.0
    k = 2 * np.pi * FREQUENCY[low] / 343.0
    # half the phase of a tube that ends there is k times its length
    acoustic_length = -0.5 * np.unwrap(np.angle(-wide[low])) / k
    assert np.all((acoustic_length > 0.1) & (acoustic_length < 0.1 + DIAMETER))
