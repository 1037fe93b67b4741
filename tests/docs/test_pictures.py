"""Pictures that are drawn from the source show the source."""

from __future__ import annotations

import importlib.util

import pytest

from paths import ROOT

FIGURES = ROOT / "docs" / "figures"


def script(name: str):
    """A script of docs/figures as a module."""
    spec = importlib.util.spec_from_file_location(name, FIGURES / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def house():
    return script("house")


def test_picture_shows_the_rooms_of_the_tree(house):
    """docs/figures/house.svg names exactly the rooms that src/rippletwin has; else run
    `python docs/figures/house.py` again."""
    assert house.rooms_drawn(house.PICTURE.read_text()) == set(house.rooms())


def test_no_arrow_runs_back(house):
    """Rooms stand on floors: none imports one that imports it, by whatever way."""
    level, arrows = house.floors(house.imports()), house.imports()
    assert all(level[target] < level[room] for room in arrows for target in arrows[room])


def test_a_circle_of_imports_is_told(house, tmp_path):
    """Two rooms that import each other are no house: the script says which."""
    package = tmp_path / "rippletwin"
    for name, other in (("one", "two"), ("two", "one")):
        (package / name).mkdir(parents=True)
        (package / name / "__init__.py").write_text("")
        (package / name / "work.py").write_text(f"from rippletwin.{other} import work\n")
    with pytest.raises(ValueError, match="one"):
        house.floors(house.imports(package))


def test_imports_inside_functions_count(house, tmp_path):
    """A late import is an arrow too."""
    package = tmp_path / "rippletwin"
    for name in ("one", "two"):
        (package / name).mkdir(parents=True)
        (package / name / "__init__.py").write_text("")
    (package / "one" / "work.py").write_text("def late():\n    import rippletwin.two.work\n")
    (package / "two" / "work.py").write_text("")
    assert house.imports(package) == {"one": {"two"}, "two": set()}


def test_rule_graph_shows_the_rules_of_a_run(monkeypatch):
    """docs/figures/rule_graph.svg names the rules that the smoke run plans; else run
    `python docs/figures/rule_graph.py` again."""
    monkeypatch.syspath_prepend(FIGURES)
    graph = script("rule_graph")
    assert graph.rules_drawn(graph.PICTURE.read_text()) == set(graph.needs())


def test_notebook_is_that_of_the_page():
    """docs/how-to/notebook.ipynb has the text and the code of notebook.md, which other tests run;
    else run `python docs/notebook_of_page.py` again. nbformat accepts it."""
    nbformat = pytest.importorskip("nbformat")
    spec = importlib.util.spec_from_file_location("made", ROOT / "docs" / "notebook_of_page.py")
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    text = made.NOTEBOOK.read_text()
    assert text == made.notebook(made.PAGE.read_text())
    nbformat.validate(nbformat.reads(text, as_version=4))


def test_steps_of_explain_are_its_modules():
    """docs/explanation/explain.md has one numbered step a module of src/rippletwin/explanation,
    numbered without a gap."""
    steps = script("explain_steps")
    listed = [step for phase in steps.phases(steps.PAGE.read_text()).values() for step in phase]
    folder = ROOT / "src" / "rippletwin" / "explanation"
    modules = [str(p.relative_to(folder)) for p in folder.rglob("*.py") if p.stem != "__init__"]
    assert sorted(module for _, module, _ in listed) == sorted(modules)
    assert [number for number, _, _ in listed] == list(range(1, len(listed) + 1))


def test_picture_of_the_steps_is_that_of_the_page():
    """docs/figures/explain_steps.svg names the steps of the page; else run
    `python docs/figures/explain_steps.py` again."""
    steps = script("explain_steps")
    drawn = steps.PICTURE.read_text()
    for phase, listed in steps.phases(steps.PAGE.read_text()).items():
        assert f">{phase}<" in drawn
        assert all(f">{number}. {module}<" in drawn for number, module, _ in listed)
