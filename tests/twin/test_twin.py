"""The twin's predictions and likelihood, each against something that is not the twin."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from harmonic_balance import balance_orifice
from paper_rig import paper_rig
from rippletwin.case.model import Load
from rippletwin.errors import InputError
from rippletwin.harmonics import flow_harmonics
from rippletwin.line.frequency_domain.line_network import FrequencyDomainLine
from rippletwin.line.frequency_domain.pipe_immittance import series_impedance, shunt_admittance
from rippletwin.twin import twin_file
from rippletwin.twin.effects.base import Place
from rippletwin.twin.effects.library import EFFECTS
from rippletwin.twin.forward_model import ForwardModel
from rippletwin.twin.reflection import to_reflection
from rippletwin.twin.twin import Twin
from synthetic_recordings import flow_ripple, line_errors, point, three_points


def test_three_points_at_once_equal_newtons_harmonic_balance_one_by_one():
    """The forward model's repeated substitution over all recordings agrees to 1e-8 with the line
    package's Newton solution of the orifice of each recording by itself, both with three harmonics
    more than are observed.
    """
    rig = paper_rig()
    points = three_points(rig)
    twin = Twin(rig, points)
    for o, predicted in zip(points, twin.predict(points)):
        orders = np.append(o.orders, o.orders[-1] + 9 * np.arange(1, 4))
        s = 2j * np.pi * orders * o.speed_hz
        network = FrequencyDomainLine(
            s=s,
            lengths=np.array([x.length for x in rig.line]),
            series=np.array(
                [
                    series_impedance(
                        s, density=870.0, viscosity=3.2e-5, diameter=x.diameter, friction="steady"
                    )
                    for x in rig.line
                ]
            ),
            shunt=np.array(
                [
                    shunt_admittance(s, density=870.0, wave_speed=x.wave_speed, diameter=x.diameter)
                    for x in rig.line
                ]
            ),
            source_flow=flow_harmonics(o.flow_ripple, orders),
            sensor_positions=np.array([x.position for x in rig.sensors]),
        )
        balance_orifice(
            network,
            mean_pressure=o.load_pressure,
            mean_flow=np.mean(o.flow_ripple.flow),
            orders=orders // 9,
            tolerance=1e-12,
        )
        error = np.abs(predicted - network.readings()[:, : len(o.orders)])
        assert np.max(error) < 1e-8 * np.max(np.abs(predicted))


def test_the_orifice_is_not_linear_at_this_ripple():
    """Without the full-amplitude orifice harmonics move by more than 0.1 %: a linear load in the
    test above would be seen.
    """
    rig = paper_rig()
    o = point(rig)
    full = Twin(rig, [o]).predict([o])[0]
    small = replace(o.flow_ripple, flow=np.mean(o.flow_ripple.flow) * np.ones(3072))
    small = replace(small, flow=small.flow + 1e-4 * (o.flow_ripple.flow - small.flow))
    linear = 1e4 * Twin(rig, [o]).predict([replace(o, flow_ripple=small)])[0]
    assert np.linalg.norm(full - linear) > 1e-3 * np.linalg.norm(full)


def test_the_shaft_angle_shifts_the_recording_in_time():
    """A recording that begins at shaft angle 0.1 rad is the same waveform, 0.1 rad further on:
    order k gains a phase of 0.1 k, through the nonlinear orifice too, to 1e-8 of the largest: its
    solution is known to as much.
    """
    rig = paper_rig()
    o = point(rig)
    twin = Twin(rig, [o])
    theta = np.zeros(len(twin.parameters))
    start = twin.predict([o], theta)[0]
    theta[twin.index["angle[a]"]] = 10.0  # of 0.01 rad each
    error = np.abs(twin.predict([o], theta)[0] - start * np.exp(0.1j * o.orders))
    assert np.max(error) < 1e-8 * np.max(np.abs(start))


def test_a_twin_survives_json_to_the_last_bit():
    """Written as JSON text and read back, a twin with effects predicts the same numbers."""
    rig = replace(paper_rig(), displacement=4e-5)
    points = three_points(rig)
    wall, pump = EFFECTS["viscoelastic_wall"], EFFECTS["source_impedance"]
    effects = [(wall, wall.places(rig)[1]), (pump, pump.places(rig)[1])]
    twin = Twin(rig, points, effects=effects)
    twin = twin.with_(theta=np.random.default_rng(0).standard_normal(len(twin.parameters)))
    again = twin_file.from_dict(json.loads(json.dumps(twin_file.to_dict(twin))))
    for one, two in zip(twin.predict(points), again.predict(points)):
        assert np.array_equal(one, two)


def test_a_twin_of_another_version_is_refused_with_its_parameters():
    """A file that lacks a parameter of this version, or has one that this version does not know, is
    refused, and its names are told, whether or not their number is the same.
    """
    data = twin_file.to_dict(Twin(paper_rig(), [point(paper_rig())]))
    data["values"]["stiffness"] = data["values"].pop("viscosity")
    with pytest.raises(InputError, match=r"another version.*stiffness, viscosity"):
        twin_file.from_dict(data)


def test_an_effect_changes_the_prediction_and_brings_its_parameters():
    """A wall that creeps is felt by the sensors, and its parameters join under its label."""
    rig = paper_rig()
    o = point(rig)
    effect = EFFECTS["viscoelastic_wall"]
    place = effect.places(rig)[1]
    plain, creeping = Twin(rig, [o]), Twin(rig, [o], effects=[(effect, place)])
    added = [p.name for p in creeping.parameters[len(plain.parameters) :]]
    assert added == [f"viscoelastic_wall@{place}.{p.name}" for p in effect.parameters(rig, place)]
    change = creeping.predict([o])[0] - plain.predict([o])[0]
    assert np.linalg.norm(change) > 1e-3 * np.linalg.norm(plain.predict([o])[0])


@pytest.mark.parametrize("turn", [1, -1])
def test_a_branch_has_the_friction_of_the_line(turn):
    """A steady line with unsteady friction for an effect, listed before the branch or after, is the
    unsteady line with the branch; with the branch left steady it would not be."""
    rig = paper_rig()
    points = three_points(rig)[:1]
    branch = (EFFECTS["side_branch"], Place("position"))
    friction = (EFFECTS["unsteady_friction"], Place("line"))
    twin = Twin(rig, points, effects=(branch, friction)[::turn])
    (found,) = twin.predict(points)
    (unsteady,) = Twin(rig, points, "unsteady", (branch,)).predict(points)
    (steady,) = Twin(rig, points, effects=(branch,)).predict(points)
    np.testing.assert_allclose(found, unsteady, rtol=1e-9)
    assert np.linalg.norm(steady - unsteady) > 0.01 * np.linalg.norm(unsteady)


def test_calibrated_rig_is_the_twin_at_its_parameters():
    """A new twin on the calibrated rig predicts at nominal what the old one does where it stands
    (viscosity, line and sensors; the load factor is at one).
    """
    rig = paper_rig()
    o = point(rig)
    twin = Twin(rig, [o])
    theta = np.random.default_rng(1).standard_normal(len(twin.parameters))
    theta[twin.index["load"]] = theta[twin.index["angle[a]"]] = 0.0
    moved = twin.with_(theta=theta)
    assert np.allclose(
        Twin(moved.calibrated_rig(), [o]).predict([o])[0], moved.predict([o])[0], rtol=1e-9
    )
    assert np.allclose(line_errors(twin, theta, theta), 0.0)


def test_faults_propagate_through_the_same_line():
    """`respond` to the healthy ripple is the prediction at shaft angle zero."""
    rig = paper_rig()
    o = point(rig)
    twin = Twin(rig, [o])
    response = twin.respond(flow_ripple(), o.speed_hz, o.load_pressure, o.orders)
    assert np.allclose(response, twin.predict([o])[0], rtol=1e-12)


@pytest.mark.parametrize("kind", ["open", "closed", "anechoic"])
def test_passive_ends_reflect_no_more_than_arrives(kind):
    """|R| <= 1 at x = 0 for every passive end (conservation of energy)."""
    rig = replace(paper_rig(), load=Load(kind))
    o = point(rig)
    network = ForwardModel(Twin(rig, [o]), [o]).network(np.zeros(len(Twin(rig, [o]).parameters)))
    first = rig.line[0]
    z = network.input_impedance() / (870.0 * first.wave_speed / first.area)
    assert np.all(np.abs(to_reflection(z)) <= 1.0 + 1e-12)
