"""Moves of the stepwise search: which fits are asked for, and which are taken."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from made_fits import made_fit
from rippletwin.explanation import fit_jobs
from rippletwin.explanation.fit_jobs import FitJob, NearFit
from rippletwin.explanation.search import single_effects, stepwise_moves
from rippletwin.explanation.search.single_effects import fit_single_effects
from rippletwin.explanation.search.stepwise_moves import (
    PROMISING,
    drop_needless_effects,
    extension_job,
    fit_extensions,
    fit_substitutes,
    simplify_effects,
)
from rippletwin.explanation.search.stepwise_search import Search
from rippletwin.explanation.thresholds import MIN_LOG_BAYES_FACTOR
from rippletwin.explanation.verdict.decision import equivalent_effects, equivalent_places
from rippletwin.twin.effects.base import Place
from rippletwin.twin.effects.library import EFFECTS, generalisations
from synthetic_observations import rig

BRANCH = (EFFECTS["side_branch"], Place("position"))
HOSE = (EFFECTS["viscoelastic_wall"], Place("segment 1", 0))
VOLUME = (EFFECTS["line_volume"], Place("position"))
VOLUME_AT_LOAD = (EFFECTS["load_volume"], Place("load"))
VOLUME_AT_PUMP = (EFFECTS["source_impedance"], Place("source", form="volume"))
VOLUME_AND_PASSAGE = (EFFECTS["source_impedance"], Place("source", form="volume and passage"))
ALWAYS_PRESENT = (
    replace(EFFECTS["unsteady_friction"], certain=lambda rig, place: True),
    Place("line"),
)


def test_every_effect_is_compared_with_its_substitutes():
    """Besides a hose, the delay of a sensor is exchanged for the other effects of that sensor and
    for a delay of the other sensor.

    Those that fit equally well make a class of names and a class of places. A single effect is
    exchanged for nothing: every other has been tried alone."""
    delay, dynamics = (
        (EFFECTS[name], Place("sensor p1", 0)) for name in ("sensor_delay", "sensor_dynamics")
    )
    delay_elsewhere = (EFFECTS["sensor_delay"], Place("sensor p2", 1))
    gain_elsewhere = (EFFECTS["sensor_gain"], Place("sensor p2", 1))
    best, asked = made_fit(100.0, delay, HOSE), []

    def fit(jobs):
        asked.extend(job.hypothesis for job in jobs)
        return [made_fit(98.0, *job.hypothesis) for job in jobs]

    workers = SimpleNamespace(fit=fit)
    candidates = [HOSE, delay, dynamics, delay_elsewhere, gain_elsewhere, VOLUME]
    substitutes = fit_substitutes(workers, best, candidates)
    assert asked == [(HOSE, dynamics), (HOSE, delay_elsewhere)]
    assert fit_substitutes(workers, made_fit(100.0, delay), [delay, dynamics]) == []
    search = Search(made_fit(0.0), [], best, substitutes)
    assert equivalent_effects(search) == (("sensor_delay", "sensor_dynamics"),)
    assert equivalent_places(search) == (
        ("sensor_delay at sensor p1", "sensor_delay at sensor p2"),
    )


@pytest.mark.parametrize(
    ("general", "special_cases"),
    [
        (VOLUME_AND_PASSAGE, [VOLUME_AT_PUMP]),
        (VOLUME, [VOLUME_AT_LOAD, VOLUME_AT_PUMP]),
        (BRANCH, [VOLUME, VOLUME_AT_LOAD, VOLUME_AT_PUMP]),
    ],
)
@pytest.mark.parametrize("cost", [MIN_LOG_BAYES_FACTOR - 1, MIN_LOG_BAYES_FACTOR + 1])
def test_a_general_effect_needs_evidence_over_its_special_cases(general, special_cases, cost):
    """A passage beside a volume at the pump, a position of its own for a volume, and a branch that
    could be one, are kept only if they add MIN_LOG_BAYES_FACTOR."""
    best, asked = made_fit(100.0, HOSE, general), []

    def fit(jobs):
        asked.extend(job.hypothesis for job in jobs)
        return [made_fit(100.0 - cost, *job.hypothesis) for job in jobs]

    workers = SimpleNamespace(base=SimpleNamespace(rig=rig()), fit=fit)
    library = [HOSE, VOLUME, VOLUME_AT_LOAD, VOLUME_AT_PUMP, VOLUME_AND_PASSAGE]
    simplified = simplify_effects(workers, best, library)
    assert asked[: len(special_cases)] == [(HOSE, special) for special in special_cases]
    if cost > MIN_LOG_BAYES_FACTOR:
        assert simplified.hypothesis == (HOSE, general) and len(asked) == len(special_cases)
    else:
        assert simplified.hypothesis[1] in special_cases


@pytest.mark.parametrize("cost", [MIN_LOG_BAYES_FACTOR - 1, MIN_LOG_BAYES_FACTOR + 1])
def test_walls_that_differ_need_evidence_over_walls_that_are_alike(cost):
    """Creep of two segments becomes that of all segments, with half the parameters, unless that
    costs MIN_LOG_BAYES_FACTOR; creep of a single segment is not tried as that of all."""
    walls = [(HOSE[0], Place(f"segment {k}", k - 1)) for k in (1, 2)]
    everywhere = (HOSE[0], Place("line"))
    asked = []

    def fit(jobs):
        asked.extend(job.hypothesis for job in jobs)
        return [made_fit(100.0 - cost, *job.hypothesis) for job in jobs]

    workers = SimpleNamespace(base=SimpleNamespace(rig=rig()), fit=fit)
    best = made_fit(100.0, *walls, VOLUME)
    simplified = simplify_effects(workers, best, [*walls, everywhere])
    assert asked == [(VOLUME, everywhere)]
    merged = cost < MIN_LOG_BAYES_FACTOR
    assert simplified.hypothesis == ((VOLUME, everywhere) if merged else best.hypothesis)
    asked.clear()
    simplify_effects(workers, made_fit(100.0, walls[0], VOLUME), [*walls, everywhere])
    assert asked == []


def test_the_general_form_of_an_effect_is_no_other_effect():
    """A volume at the load that a branch and a volume on the line fit as well is one family, told
    as such; a hose that fits as well is another effect."""
    best = made_fit(100.0, VOLUME_AT_LOAD)
    general = [made_fit(99.0, BRANCH), made_fit(99.0, VOLUME)]
    assert equivalent_effects(Search(made_fit(0.0), [], best, general)) == ()
    (names,) = equivalent_effects(Search(made_fit(0.0), [], best, [*general, made_fit(99.0, HOSE)]))
    assert names == ("load_volume", "viscoelastic_wall")
    assert set(generalisations(*VOLUME_AT_LOAD)) == {"line_volume", "side_branch"}


def test_a_line_may_have_several_of_one_effect(monkeypatch):
    """Beside a volume another volume is a candidate, with a number of its own, up to four; beside a
    sensor's gain the gain of another sensor, and not its own again."""
    monkeypatch.setattr(stepwise_moves, "NearFit", lambda fit: None)
    gains = [(EFFECTS["sensor_gain"], Place(f"sensor p{k}", k - 1)) for k in (1, 2)]
    asked = []

    def fit(jobs, report=None):
        asked.extend(job.hypothesis for job in jobs)
        return [made_fit(1.0, *job.hypothesis) for job in jobs]

    workers = SimpleNamespace(base=SimpleNamespace(rig=rig()), fit=fit)
    fit_extensions(workers, made_fit(0.0, VOLUME, gains[0]), [VOLUME, *gains], None)
    second = (VOLUME[0], Place("position", number=2))
    assert asked == [(VOLUME, gains[0], second), (VOLUME, gains[0], gains[1])]
    asked.clear()
    four = [(VOLUME[0], Place("position", number=n)) for n in (1, 2, 3, 4)]
    fit_extensions(workers, made_fit(0.0, *four), [VOLUME], None)
    assert asked == []


@pytest.mark.parametrize(("model_error", "is_asked"), [(0.004, False), (0.3, True)])
def test_poor_fits_are_also_started_near_the_fit_without_the_effect(
    monkeypatch, model_error, is_asked
):
    """Where fits from nominal values leave a large `model_error`, every effect is also started near
    the base. An effect that is added to a fit always starts near it."""
    monkeypatch.setattr(single_effects, "transfer_theta", lambda *_: None)
    started_near = []

    def fit_one(job):
        if not job.hypothesis:
            return made_fit(0.0, model_error=0.3)
        if isinstance(job.start, NearFit):
            started_near.append(job.hypothesis)
            return made_fit(50.0, *job.hypothesis)
        return made_fit(10.0, *job.hypothesis, model_error=model_error)

    workers = SimpleNamespace(
        base=SimpleNamespace(rig=rig()),
        fit=lambda jobs, report=None: [fit_one(job) for job in jobs],
        observations=("point 1", "point 2"),
    )
    base, _, fits = fit_single_effects(workers, [HOSE, VOLUME])
    assert base.evidence == 0.0
    assert started_near == ([(HOSE,), (VOLUME,)] if is_asked else [])
    assert [f.evidence for f in fits] == ([50.0, 50.0] if is_asked else [10.0, 10.0])
    monkeypatch.setattr(stepwise_moves, "restart_job", lambda best, h, rig: FitJob(h))
    started_near.clear()
    best = made_fit(10.0, HOSE, model_error=0.3)
    extensions = fit_extensions(workers, best, [HOSE, VOLUME], None)
    assert (HOSE, VOLUME) in started_near
    assert extensions[0].evidence == 50.0


def test_needless_effects_are_dropped_weakest_first(monkeypatch):
    """Without the volume hardly any evidence is lost, without the hose more than a name needs.

    An always-present effect is dropped only if the data are clearly against it."""
    losses = {HOSE: MIN_LOG_BAYES_FACTOR + 1, VOLUME: MIN_LOG_BAYES_FACTOR - 1, ALWAYS_PRESENT: 0}
    monkeypatch.setattr(fit_jobs, "transfer_theta", lambda *_: None)

    def fit(jobs):
        return [
            made_fit(-sum(x for e, x in losses.items() if e not in j.hypothesis), *j.hypothesis)
            for j in jobs
        ]

    workers = SimpleNamespace(base=None, fit=fit)
    kept = drop_needless_effects(workers, made_fit(0.0, HOSE, VOLUME, ALWAYS_PRESENT))
    assert kept.hypothesis == (HOSE, ALWAYS_PRESENT)
    del losses[VOLUME]
    losses[ALWAYS_PRESENT] = -4.0
    kept = drop_needless_effects(workers, made_fit(0.0, HOSE, ALWAYS_PRESENT))
    assert kept.hypothesis == (HOSE,)


def test_candidates_are_fitted_until_one_adds_what_the_next_promises(monkeypatch):
    """Two are fitted at a time, in the order of their promises. The third promises less than one of
    the first two has added, so it is not fitted; nor is one that promises next to nothing."""
    places = [(EFFECTS["sensor_delay"], Place(f"sensor p{k}", k)) for k in range(1, 12)]
    promises = dict(zip(places, [30.0, 40.0, 25.0, 20.0, *[1.0] * 7]))
    monkeypatch.setattr(stepwise_moves, "rank_at_exact_modes", lambda workers, best, fits: fits)

    def asked_for(gain):
        asked = []

        def fit(jobs, report=None):
            asked.extend(job.hypothesis[-1] for job in jobs)
            return [made_fit(100.0 + gain, *job.hypothesis) for job in jobs]

        def score(function, jobs):
            return [(promises[job.hypothesis[-1]], job) for job in jobs]

        workers = SimpleNamespace(fit=fit, map=score, base=SimpleNamespace(rig=rig()))
        fit_extensions(workers, made_fit(100.0, HOSE), places, None)
        return [places.index(candidate) for candidate in asked]

    assert asked_for(gain=28.0) == [1, 0]
    assert asked_for(gain=22.0) == [1, 0, 2, 3]
    assert asked_for(gain=-5.0) == [1, 0, 2, 3]


def test_the_volume_of_a_pump_is_always_present_where_its_flow_is_stated():
    """The stated flow goes into a constant pressure and leaves out the chambers; a simulated pump
    has them. Leakage alone is then no candidate: no pump is without a volume."""
    effect, volume = VOLUME_AT_PUMP
    stated, simulated = replace(rig(), displacement=2e-5), rig()
    assert effect.certain(stated, volume)
    assert not effect.certain(stated, VOLUME_AND_PASSAGE[1])
    assert not effect.certain(simulated, volume)
    forms = [[place.form for place in effect.places(r)] for r in (stated, simulated)]
    assert forms == [["volume", "volume and passage"], ["leakage", "volume", "volume and passage"]]


def test_a_form_with_more_parameters_takes_the_place_of_the_one_with_fewer():
    """The pump has one volume, also where a passage is added to it."""
    job = extension_job(made_fit(0.0, HOSE, VOLUME_AT_PUMP), VOLUME_AND_PASSAGE)
    assert job.hypothesis == (HOSE, VOLUME_AND_PASSAGE)


def test_always_present_effects_are_fitted_whatever_they_promise(monkeypatch):
    """A score test does not decide about them, and they leave room for others: with them one more
    may be fitted than are promising."""
    places = [(EFFECTS["sensor_delay"], Place(f"sensor p{k}", k)) for k in range(1, 12)]
    monkeypatch.setattr(stepwise_moves, "rank_at_exact_modes", lambda workers, best, fits: fits)
    asked = []

    def fit(jobs, report=None):
        asked.extend(job.hypothesis[-1] for job in jobs)
        for _ in jobs if report else ():
            report()
        return [made_fit(100.0, *job.hypothesis) for job in jobs]

    def score(function, jobs):
        return [(promise, job) for job in jobs]

    workers = SimpleNamespace(fit=fit, map=score, base=SimpleNamespace(rig=rig()))
    candidates, told = [*places, ALWAYS_PRESENT], []
    promise = 0.0
    fit_extensions(workers, made_fit(100.0, HOSE), candidates, None)
    assert asked == [ALWAYS_PRESENT]
    promise = 50.0
    fit_extensions(workers, made_fit(100.0, HOSE), candidates, lambda *each: told.append(each))
    assert told[-1] == ("2 effects", PROMISING + 1, PROMISING + 1)


def test_usual_effects_take_no_room_from_what_is_searched_for(monkeypatch):
    """Beside the pump's volume and creep of all walls there may be four different effects, and no
    fifth, but another usual one. Radiation from an open end is searched for with the others, and is
    one of four; so is friction."""
    monkeypatch.setattr(stepwise_moves, "rank_at_exact_modes", lambda workers, best, fits: fits)
    four = [(EFFECTS["entrained_air"], Place("line")), (EFFECTS["leak"], Place("position"))]
    four += [HOSE, VOLUME]
    usual = [VOLUME_AT_PUMP, (HOSE[0], Place("line"))]
    friction = (EFFECTS["unsteady_friction"], Place("line"))
    gain = (EFFECTS["sensor_gain"], Place("sensor p1", 0))
    stated = replace(rig(), displacement=2e-5)
    asked = []

    def fit(jobs, report=None):
        asked.extend(job.hypothesis[-1] for job in jobs)
        return []

    workers = SimpleNamespace(fit=fit, base=SimpleNamespace(rig=stated))
    fit_extensions(workers, made_fit(0.0, *usual, *four[:3]), [gain], None)
    assert asked == [gain]
    fit_extensions(workers, made_fit(0.0, *usual, *four), [gain, friction], None)
    assert asked.pop() == friction
    for counted in ((EFFECTS["end_radiation"], Place("load")), friction):
        fit_extensions(workers, made_fit(0.0, counted, *four[:3]), [gain], None)
    assert asked == [gain]
