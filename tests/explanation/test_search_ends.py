"""The stepwise search comes to an end where an exchange and a simplification undo each other."""

from types import SimpleNamespace

from made_fits import made_fit
from rippletwin.explanation.search import stepwise_search
from rippletwin.explanation.search.stepwise_search import Search, _search_stepwise
from rippletwin.twin.effects.base import Place
from rippletwin.twin.effects.library import EFFECTS

VOLUME = (EFFECTS["line_volume"], Place("position"))
BRANCH = (EFFECTS["side_branch"], Place("position"))
WALL = (EFFECTS["viscoelastic_wall"], Place("segment 1", 0))


def test_an_exchange_that_simplifying_undoes_ends_the_search(monkeypatch):
    """A branch is a little better than the volume that it contains, so the exchange takes it and
    the simplification takes it back. The search ends with the volume after one round."""
    rounds = []
    volume, branch = made_fit(100.0, VOLUME), made_fit(103.0, BRANCH)

    def exchange(workers, best, fits):
        rounds.append(best.label)
        return branch if best.hypothesis == (VOLUME,) else best

    monkeypatch.setattr(stepwise_search, "exchange_effects", exchange)
    monkeypatch.setattr(stepwise_search, "_revise", lambda *_: made_fit(100.0, VOLUME))
    monkeypatch.setattr(stepwise_search, "move_to_best_position", lambda w, fit: (fit, []))
    monkeypatch.setattr(stepwise_search, "fit_extensions", lambda *_: [])
    monkeypatch.setattr(stepwise_search, "fit_substitutes", lambda *_: [])
    base = made_fit(0.0)
    start = Search(base, [], volume)
    found = _search_stepwise(SimpleNamespace(), start, [VOLUME, BRANCH], None)
    assert found.best.hypothesis == (VOLUME,) and len(rounds) == 1


def test_where_an_exchange_is_undone_the_answers_own_positions_are_searched(monkeypatch):
    """The branch of the exchange is simplified to the volume again. The other positions of the
    answer are then those of the volume, and a better one of them becomes the answer."""
    volume, elsewhere = made_fit(100.0, VOLUME), made_fit(105.0, VOLUME)
    branch = made_fit(103.0, BRANCH)
    others = {id(volume): made_fit(99.0, VOLUME), id(elsewhere): made_fit(104.0, VOLUME)}

    def search(better):
        def move(workers, fit):
            if fit is branch:
                return fit, [made_fit(102.0, BRANCH)]
            fit = elsewhere if better else fit
            return fit, [others[id(fit)]]

        monkeypatch.setattr(stepwise_search, "exchange_effects", lambda *_: branch)
        monkeypatch.setattr(stepwise_search, "_revise", lambda *_: volume)
        monkeypatch.setattr(stepwise_search, "move_to_best_position", move)
        monkeypatch.setattr(stepwise_search, "fit_extensions", lambda *_: [])
        monkeypatch.setattr(stepwise_search, "fit_substitutes", lambda *_: [])
        start = Search(made_fit(0.0), [], volume)
        return _search_stepwise(SimpleNamespace(), start, [VOLUME, BRANCH], None)

    for better, answer in ((False, volume), (True, elsewhere)):
        found = search(better)
        assert found.best is answer and found.other_positions == [others[id(answer)]]


def test_an_exchange_back_to_an_earlier_explanation_ends_the_search(monkeypatch):
    """From a volume the search comes to a volume and a wall, from there an exchange leads back to
    the volume alone. The search ends with both after one exchange."""
    volume = made_fit(100.0, VOLUME)
    both, exchanged = made_fit(120.0, VOLUME, WALL), made_fit(122.0, BRANCH, WALL)
    exchanges = []

    def exchange(workers, best, fits):
        exchanges.append(best.label)
        return exchanged

    def revise(workers, best, candidates):
        return volume if best is exchanged else best

    def extend(workers, best, candidates, progress):
        return [both] if best.hypothesis == (VOLUME,) else []

    monkeypatch.setattr(stepwise_search, "exchange_effects", exchange)
    monkeypatch.setattr(stepwise_search, "_revise", revise)
    monkeypatch.setattr(stepwise_search, "move_to_best_position", lambda w, fit: (fit, []))
    monkeypatch.setattr(stepwise_search, "fit_extensions", extend)
    monkeypatch.setattr(stepwise_search, "fit_substitutes", lambda *_: [])
    start = Search(made_fit(0.0), [], volume)
    found = _search_stepwise(SimpleNamespace(), start, [VOLUME, BRANCH, WALL], None)
    assert found.best is both and len(exchanges) == 1


def test_a_better_substitute_goes_on_with_the_search(monkeypatch):
    """Where no extension and no exchange of the best single effects is better, but a branch in the
    volume's place is, the search goes on beside the branch and finds the wall."""
    fits = {(VOLUME,): 100.0, (BRANCH,): 130.0, (BRANCH, WALL): 150.0}

    def extend(workers, best, candidates, progress):
        longer = (*best.hypothesis, WALL)
        return [made_fit(fits[longer], *longer)] if longer in fits else []

    def substitute(workers, best, candidates):
        return [made_fit(130.0, BRANCH)] if best.hypothesis == (VOLUME,) else []

    monkeypatch.setattr(stepwise_search, "exchange_effects", lambda w, best, fits: best)
    monkeypatch.setattr(stepwise_search, "_revise", lambda w, best, candidates: best)
    monkeypatch.setattr(stepwise_search, "move_to_best_position", lambda w, fit: (fit, []))
    monkeypatch.setattr(stepwise_search, "fit_extensions", extend)
    monkeypatch.setattr(stepwise_search, "fit_substitutes", substitute)
    start = Search(made_fit(0.0), [], made_fit(100.0, VOLUME))
    found = _search_stepwise(SimpleNamespace(), start, [VOLUME, BRANCH, WALL], None)
    assert found.best.hypothesis == (BRANCH, WALL)
