"""Which source files a script runs: what its jobs have to run again for."""

import re

import pytest

import rippletwin
import source_files
from paths import ROOT
from source_files import PLUGIN_FOLDERS, package_files, source_files_of


@pytest.fixture
def project(tmp_path, monkeypatch):
    """Write a file of a small project, {root}/src and {root}/scripts being its import roots."""
    for name in ("_imported_files", "_files_run_by"):  # what was found in the real project
        monkeypatch.setattr(source_files, name, _fresh(getattr(source_files, name)))
    monkeypatch.setattr(source_files, "ROOT", tmp_path)
    monkeypatch.setattr(source_files, "IMPORT_ROOTS", (tmp_path / "src", tmp_path / "scripts"))
    monkeypatch.setattr(source_files, "PLUGIN_FOLDERS", {})

    def write(name: str, text: str = "") -> None:
        file = tmp_path / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)

    def names(path: str) -> list[str]:
        return [str(file.relative_to(tmp_path)) for file in source_files_of(path)]

    write("src/library/__init__.py")
    return write, names


def _fresh(cached):
    """The same function with an empty cache of its own."""
    return source_files.cache(cached.__wrapped__)


def test_imports_of_imports_with_every_package_on_the_way(project):
    """A module two imports away counts, and so do the __init__ files of its packages, with what
    they import; the script itself and modules of other projects do not."""
    write, names = project
    write("scripts/job.py", "import sys, numpy\n")
    write("scripts/run.py", "from job import start\nfrom library.room.first import f\n")
    write("src/library/room/__init__.py", "import library.data\n")
    write("src/library/room/first.py", "import library.second as second\n")
    write("src/library/second.py")
    write("src/library/data.py")
    write("src/library/unused.py")
    assert names("scripts/run.py") == [
        "scripts/job.py",
        "src/library/__init__.py",
        "src/library/data.py",
        "src/library/room/__init__.py",
        "src/library/room/first.py",
        "src/library/second.py",
    ]


def test_late_and_relative_imports_count(project):
    """An import within a function, `from . import`, `from .. import` and `from .x import`; the name
    that follows `import` may be a module or not."""
    write, names = project
    write("scripts/run.py", "def late():\n    from library.room import inner\n")
    write("src/library/room/__init__.py", "from . import near\n")
    write("src/library/room/inner.py", "from .. import far\nfrom .side import value\n")
    for name in ("near", "side"):
        write(f"src/library/room/{name}.py", "value = 1\n")
    write("src/library/far.py")
    found = names("scripts/run.py")
    assert {f"src/library/room/{name}.py" for name in ("inner", "near", "side")} <= set(found)
    assert "src/library/far.py" in found


def test_an_import_for_type_checkers_does_not_count(project):
    """It never runs; what stands beside it does."""
    write, names = project
    write(
        "scripts/run.py", "if TYPE_CHECKING:\n    import library.a\nelse:\n    import library.b\n"
    )
    for name in ("a", "b"):
        write(f"src/library/{name}.py")
    assert names("scripts/run.py") == ["src/library/__init__.py", "src/library/b.py"]


def test_modules_that_import_each_other_end(project):
    """A circle of imports is walked once; the script is in the result where another imports it."""
    write, names = project
    write("src/library/a.py", "import library.b\n")
    write("src/library/b.py", "import library.a\n")
    assert names("src/library/a.py")[1:] == ["src/library/a.py", "src/library/b.py"]


def test_a_plugin_folder_counts_as_a_whole(project, monkeypatch):
    """Whoever imports the registry runs every plugin, and what the plugins import."""
    write, names = project
    write("scripts/run.py", "import library.plugins.registry\n")
    write("src/library/plugins/registry.py", "import pkgutil\n")
    write("src/library/plugins/one.py", "import library.shared\n")
    write("src/library/shared.py")
    assert "src/library/plugins/one.py" not in names("scripts/run.py")
    folders = {"src/library/plugins/registry.py": "src/library/plugins"}
    monkeypatch.setattr(source_files, "PLUGIN_FOLDERS", folders)
    monkeypatch.setattr(source_files, "_imported_files", _fresh(source_files._imported_files))
    assert {"src/library/plugins/one.py", "src/library/shared.py"} <= set(names("scripts/run.py"))


def test_a_file_is_parsed_once(project, monkeypatch):
    """Two scripts that share a module: four files, four parses, however often they are asked."""
    write, names = project
    write("scripts/one.py", "import library.shared\n")
    write("scripts/two.py", "import library.shared\n")
    write("src/library/shared.py")
    parsed, parse = [], source_files.ast.parse
    monkeypatch.setattr(source_files.ast, "parse", lambda text: parsed.append(1) or parse(text))
    for script in ("one", "two", "one"):
        names(f"scripts/{script}.py")
    assert len(parsed) == 4


def test_a_relative_import_outside_the_roots_is_an_error(project):
    """Nobody can say what it means."""
    write, names = project
    write("elsewhere/run.py", "from . import x\n")
    with pytest.raises(ValueError, match=r"elsewhere/run\.py"):
        names("elsewhere/run.py")


def test_a_program_of_the_library_is_followed_like_a_script():
    """The concealed tool lies in src/, not among the scripts: its own package and the explanation
    are found, the networks and the rig that hides the effect are not."""
    found = {str(file.relative_to(ROOT)) for file in source_files_of("src/concealed/tool.py")}
    assert {"src/concealed/__init__.py", "src/rippletwin/explanation/explain.py"} <= found
    assert not [
        name for name in found if name.startswith(("src/virtualrig/", "src/rippletwin/lea"))
    ]


def test_every_effect_and_every_reader_of_recordings_counts():
    """They are imported by computed names: a recording's format and an effect's physics."""
    found = set(source_files_of("workflow/scripts/calibrate.py"))
    for folder in ("twin/effects", "case/readers"):
        assert set((ROOT / "src/rippletwin" / folder).glob("*.py")) <= found


def test_whoever_imports_by_a_computed_name_is_declared():
    """A new registry has to be added to PLUGIN_FOLDERS, or its plugins would rerun nothing. The
    package's own functions for notebooks need not be: no script and no module asks for them."""
    computed = re.compile(r"\bpkgutil\.|\bimport_module\(|\b__import__\(")
    found = {
        file.relative_to(ROOT).as_posix()
        for file in (ROOT / "src").rglob("*.py")
        if computed.search(file.read_text())
    }
    assert found == {*PLUGIN_FOLDERS, "src/rippletwin/__init__.py"}
    functions = "|".join(rippletwin.__all__[1:])
    asked = re.compile(
        rf"\brippletwin\.({functions})\b(?!\.)|from rippletwin import .*\b({functions})\b"
    )
    code = [*(ROOT / "src").rglob("*.py"), *(ROOT / "workflow").rglob("*.py")]
    assert asked.search("from rippletwin import store, explain")
    assert not [file for file in code if asked.search(file.read_text())]
    assert all((ROOT / folder).is_dir() for folder in PLUGIN_FOLDERS.values())


def test_data_of_a_package_count_where_they_are_read():
    """The report's templates and the schema of rig.yaml; whoever reads a file of its package has to
    be added to DATA_FILES, or an edit of it would rerun nothing."""
    page = source_files_of("workflow/scripts/report_page.py")
    assert {"page.html", "page.css", "page.js", "rig.schema.yaml"} <= {file.name for file in page}
    reads = re.compile(r"\bfiles\(\"rippletwin")
    found = {
        file.relative_to(ROOT).as_posix()
        for file in (ROOT / "src/rippletwin").rglob("*.py")
        if reads.search(file.read_text())
    }
    assert found == set(source_files.DATA_FILES)


def test_another_program_counts_with_its_data():
    """The virtual rig is run as a command: all its code, and the sheets that it draws from."""
    names = {file.name for file in package_files("virtualrig")}
    assert {"cli.py", "stepper.py", "sheet.yaml"} <= names


def test_scripts_are_thin():
    """What a script does beyond opening and saving files belongs in the library, with a test."""
    long = [
        file.name
        for file in (ROOT / "workflow/scripts").glob("*.py")
        if len(file.read_text().splitlines()) >= 60
    ]
    assert not long
    assert len((ROOT / "workflow/rules/common.smk").read_text().splitlines()) < 150
