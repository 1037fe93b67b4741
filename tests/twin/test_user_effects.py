"""Effects of users' files: taken into the library, carried by twin.json and by processes."""

import json
import pickle
from dataclasses import replace

import numpy as np
import pytest

from rippletwin.errors import InputError
from rippletwin.explanation.fit_jobs import FitJob, open_workers
from rippletwin.explanation.search.stepwise_search import applicable_candidates
from rippletwin.twin import twin_file
from rippletwin.twin.effects import library
from rippletwin.twin.effects.base import Place
from rippletwin.twin.effects.own_effects import check_on_rig
from rippletwin.twin.twin import Twin
from synthetic_observations import make
from two_domains import corrected, rig

OWN = """
from rippletwin.line.frequency_domain.line_network import Insert
from rippletwin.twin.effects.base import Effect, on_line, position_parameter, position_place
from rippletwin.twin.parameters import Parameter
from rippletwin.twin.priors import lognormal


def apply(network, state, values, place):
    resistance = values["resistance"] + 0.0 * network.s
    network.inserts.append(Insert(on_line(network, values["position"]), "series", resistance))


EFFECT = Effect(
    name="{name}",
    element="position",
    medium="any",
    equation="p1 - p2 = R q",
    source="a user",
    parameters=lambda rig, place: (
        position_parameter(rig),
        Parameter("resistance", "Pa s/m3", lognormal(1e9, 1.0)),
    ),
    places=position_place,
    apply=apply,
)
"""


@pytest.fixture
def own(tmp_path):
    """A user's file; what it adds to the library is taken out again."""
    before = dict(library.EFFECTS)
    path = tmp_path / "throttle.py"
    path.write_text(OWN.format(name="throttle"))
    yield path
    library.EFFECTS.clear()
    library.EFFECTS.update(before)


def test_a_file_is_a_candidate_like_any_other(own):
    """Given twice it is one effect, offered where it can be, and pickled by its name."""
    (effect,) = library.add_effects([own], rig())
    assert library.add_effects([own]) == (effect,)
    _, observations, _ = make(np.random.default_rng(0))
    offered = applicable_candidates(rig(), observations)
    assert [(e.name, p) for e, p in offered if e is effect] == [("throttle", Place("position"))]
    assert pickle.loads(pickle.dumps(effect)) is effect


def test_worker_processes_know_it(own):
    """A resistance of 2e9 Pa s/m3 that is in the data is found within 5 %, in other processes."""
    (effect,) = library.add_effects([own])
    hypothesis = ((effect, Place("position")),)
    name = "throttle@position"
    truth = {f"{name}.position": 4.4, f"{name}.resistance": 2e9}
    bench, observations, _ = make(np.random.default_rng(1), hypothesis, truth, source=0.002)
    with open_workers(Twin(bench, observations), observations, 2) as workers:
        base, fit = workers.fit([FitJob(()), FitJob(hypothesis)])
    assert fit.hypothesis[0][0] is effect
    assert fit.evidence > base.evidence + 50
    assert fit.twin.values()[f"{name}.resistance"] == pytest.approx(2e9, rel=0.05)


def test_twin_json_names_the_file_that_it_needs(own, tmp_path):
    """Without the file the message names effect, file and option; with it the twin is as before."""
    (effect,) = library.add_effects([own])
    twin = corrected((effect, Place("position")))
    path = tmp_path / "twin.json"
    path.write_text(json.dumps(twin_file.to_dict(twin)))
    del library.EFFECTS["throttle"]
    with pytest.raises(InputError, match=r"throttle.*throttle\.py") as error:
        twin_file.load_twin(path)
    assert error.value.file == str(path) and "--effects" in error.value.remedy
    again = twin_file.load_twin(path, [own])
    np.testing.assert_array_equal(again.theta, twin.theta)
    assert again.effects[0][0].name == "throttle"


@pytest.mark.parametrize(
    ("old", "new", "field", "words"),
    [
        ("EFFECT = Effect", "OTHER = Effect", "EFFECT", "missing, or no Effect"),
        ("import lognormal", "import nothing", "EFFECT", "cannot import name"),
        ('name="throttle"', 'name="leak"', "EFFECT.name", "an effect 'leak' already"),
        ('name="throttle"', 'name="a throttle"', "EFFECT.name", "no name"),
        ('element="position"', 'element="pipe"', "EFFECT.element", "'pipe' is not known"),
        ('medium="any"', 'medium="water"', "EFFECT.medium", "'water' is not known"),
        ("position_parameter(rig),", "", "EFFECT.parameters", "has none"),
        ('values["resistance"] +', 'values["resistanse"] +', "EFFECT.apply", "KeyError"),
        ('values["resistance"] +', '-values["resistance"] +', "EFFECT.apply", "gives energy"),
        ('values["resistance"] +', "np_inf +", "EFFECT.apply", "np_inf"),
        ('"position"]), "series"', '"position"]), "serial"', "EFFECT.apply", "'series'"),
    ],
)
def test_a_bad_file_is_bad_input(own, old, new, field, words):
    """The message names the file, the field and what is wrong with it."""
    own.write_text(own.read_text().replace(old, new))
    with pytest.raises(InputError, match=words) as error:
        library.add_effects([own], rig())
    assert (error.value.file, error.value.field) == (str(own), field)
    assert error.value.remedy


def test_an_effect_of_the_source_is_tried_too():
    """Effects at shaft orders are given a shaft: those of the library pass as a user's would. One
    whose flow is not finite is refused."""
    for name in ("piston_spread", "speed_fluctuation"):
        check_on_rig(replace(library.EFFECTS[name], file="own.py"), rig())

    def lose(network, state, values, place):
        network.source_flow = np.nan * state.mean_flow

    broken = replace(library.EFFECTS["piston_spread"], apply=lose, file="own.py")
    with pytest.raises(InputError, match="is not finite"):
        check_on_rig(broken, rig())


@pytest.mark.parametrize("place", ["segment 1", "sensor p1"])
def test_a_place_without_its_index_is_bad_input(place):
    """The effect would act on all segments, or correct all sensors."""
    name = "viscoelastic_wall" if place.startswith("segment") else "sensor_gain"
    effect = replace(library.EFFECTS[name], file="own.py", places=lambda rig: (Place(place),))
    with pytest.raises(InputError, match="without an index"):
        check_on_rig(effect, rig())


def test_no_file_is_bad_input(tmp_path):
    """A path where nothing is."""
    with pytest.raises(InputError, match="no such file"):
        library.add_effects([tmp_path / "throttle.py"])
