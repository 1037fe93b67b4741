"""The self-check's scoring of names, on a case as it draws them."""

import numpy as np

from explain_selfcheck import compare_names
from selfcheck_cases import draw_case


def claim(name, place, values):
    """An effect as a verdict names it, with an interval about its position."""
    position = values.get("position")
    parameters = (
        {} if position is None else {"position": {"ci95": [position - 0.1, position + 0.1]}}
    )
    return {"name": name, "element": place.element, "parameters": parameters}


def test_true_effects_are_right_and_others_wrong():
    """Of a pair both are named, and an effect that is not there; then one by an equivalent name."""
    rig, _, truth = draw_case(np.random.default_rng(3), "pair")
    effects = truth.effect_values(truth.theta)
    names = [effect.name for effect, _, _ in effects]
    claims = [claim(effect.name, place, values) for effect, place, values in effects]
    other = claims[0] | {"name": "not there"}
    found = compare_names(rig, truth, {"effects": [*claims, other], "equivalents": []})
    assert found == (names, ["not there"])
    alike = {"effects": [other], "equivalents": [[names[0], "not there"]]}
    assert compare_names(rig, truth, alike) == (names[:1], [])
