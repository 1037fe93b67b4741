"""Write the tables of docs from the source that they describe.

    python docs/reference/tables.py

A table stands between `<!-- table: KIND NAME -->` and `<!-- end -->`. Kinds: `effect` (of the
library), `keys` (of a section of rig.yaml, from its schema), `modules` (of a package, from the
first line of their docstrings), `help` (what a command prints with --help), `nuisance` (physics of
the diagnosis trial's rigs).

Priors are those of the paper's line (resources/paper_rig.yaml) for a liquid, and of the air tube
(resources/air_tube/rig.yaml) for a gas.
"""

from __future__ import annotations

import ast
import contextlib
import importlib
import io
import os
import re
from dataclasses import replace
from pathlib import Path

import yaml

from rippletwin.case.model import Fluid, Load, Rig, Segment, Sensor
from rippletwin.twin.effects.library import EFFECTS
from virtualrig.draw_nuisance import NUISANCE

FOLDER = Path(__file__).resolve().parent
ROOT = FOLDER.parents[1]
SCHEMA = ROOT / "src" / "rippletwin" / "case" / "rig.schema.yaml"
MEDIA = {"any": "liquid and gas", "liquid": "liquid", "gas": "gas"}
TWO_SIGMA = 1.96
WIDTH = "100"  # of what --help prints


def effect(name: str) -> str:
    """Place, equation, source and priors of an effect."""
    found = EFFECTS[name]
    rig = _rig_of(found.medium)
    if not found.places(rig):
        rig = replace(rig, load=Load("anechoic"))
    rows = [
        ("name", f"`{found.name}`"),
        ("acts on", found.element),
        ("medium", MEDIA[found.medium]),
        ("equation", found.equation),
        ("source", found.source),
    ]
    for place in found.places(rig):
        form = "" if place.form is None else f" ({place.form})"
        for p in found.parameters(rig, place):
            unit = "" if p.unit == "1" else f" {p.unit}"
            rows.append((f"`{p.name}`{form}", f"{_prior_in_words(p.prior)}{unit}"))
    return _table(("", ""), dict.fromkeys(rows))


def keys(section: str) -> str:
    """Keys of a section of rig.yaml with type and meaning."""
    schema = yaml.safe_load(SCHEMA.read_text())
    node = schema["properties"][section]
    node = node.get("items", node)
    if section == "line":
        node = node["properties"]["segments"]["items"]
    rows = []
    for key, entry in node["properties"].items():
        needed = "yes" if key in node.get("required", ()) else ""
        what = ", ".join(f"`{v}`" for v in entry["enum"]) if "enum" in entry else entry["type"]
        rows.append((f"`{key}`", what, needed, entry["description"]))
    return _table(("key", "value", "required", "meaning"), rows)


def modules(package: str) -> str:
    """Modules of a package, its sub-packages included, in one line each."""
    folder = ROOT / "src" / package
    files = [p for p in sorted(folder.rglob("*.py")) if p.stem != "__init__"]
    if not (folder / "__init__.py").exists():
        raise ValueError(f"{package} is no package")
    if package == "rippletwin":
        files = [p for p in files if p.parent == folder]
    rows = [
        (f"`{path.relative_to(folder)}`", _first_line(ast.get_docstring(ast.parse(text)) or ""))
        for path in files
        for text in [path.read_text()]
    ]
    return _table(("module", "what it does"), rows)


def help(command: str) -> str:
    """What `rippletwin COMMAND --help` prints, or another program's: "virtualrig:record"."""
    program, _, words = command.rpartition(":")
    main = importlib.import_module(f"{program or 'rippletwin'}.cli").main
    text, before = io.StringIO(), dict(os.environ)
    os.environ.update(COLUMNS=WIDTH, NO_COLOR="1")
    try:
        with contextlib.redirect_stdout(text), contextlib.suppress(SystemExit):
            main([*([words] if words else []), "--help"])
    finally:
        os.environ.clear()
        os.environ.update(before)
    return f"```text\n{text.getvalue().rstrip()}\n```\n"


def nuisance(_: str) -> str:
    """Nuisance physics of a population's rigs: ranges and sources."""
    rows = [
        (r.what, f"{PLUS_MINUS[r.scale]}{r.low:g} to {r.high:g}", r.unit, SCALES[r.scale], r.source)
        for r in NUISANCE.values()
    ]
    return _table(("quantity", "size", "unit", "drawn", "source"), rows)


PLUS_MINUS = {"uniform": "", "log": "", "signed": "± "}
SCALES = {"uniform": "evenly", "log": "log-uniform", "signed": "evenly, either sign"}
KINDS = {kind.__name__: kind for kind in (effect, keys, modules, help, nuisance)}


def fill(page: str) -> str:
    """The page with every table as the source has it now."""

    def replaced(match: re.Match) -> str:
        return f"<!-- table: {match[1]} {match[2]} -->\n{KINDS[match[1]](match[2])}<!-- end -->"

    return re.sub(r"<!-- table: (\w+) ([\w/:]+) -->\n(?s:.*?)<!-- end -->", replaced, page)


def _table(header: tuple[str, ...], rows) -> str:
    lines = [header, tuple("---" for _ in header), *rows]
    escaped = [[cell.replace("|", "\\|") for cell in line] for line in lines]
    return "".join(f"| {' | '.join(line)} |\n" for line in escaped)


def _first_line(docstring: str) -> str:
    """The first paragraph's first sentence."""
    text = " ".join(docstring.split("\n\n")[0].split())
    return re.split(r"(?<=[.?!])\s(?=[A-Z`])", text)[0]


def _rig_of(medium: str) -> Rig:
    """The rig whose priors are shown for a medium."""
    if medium == "gas":
        sheet = yaml.safe_load((ROOT / "resources/air_tube/rig.yaml").read_text())
        line = tuple(Segment(**segment) for segment in sheet["line"]["segments"])
        return Rig(Fluid(**sheet["fluid"]), {}, line, (), Load("open"))
    sheet = yaml.safe_load((ROOT / "resources/paper_rig.yaml").read_text())
    line = tuple(Segment(**segment) for segment in sheet["segments"])
    sensors = tuple(Sensor(f"p{k + 1}", x) for k, x in enumerate(sheet["sensors"]))
    fluid = Fluid(density=870.0, kinematic_viscosity=3.2e-5)
    return Rig(fluid, {"pistons": sheet["pistons"]}, line, sensors, Load("orifice"))


def _prior_in_words(prior) -> str:
    """A prior as a reader wants it: centre and 95 % range, or ends."""
    low, high = (float(prior.value(u)) for u in (-TWO_SIGMA, TWO_SIGMA))
    if prior.kind == "uniform":
        return f"uniform, {prior.centre:.3g} to {prior.centre + prior.scale:.3g}"
    if prior.kind == "bounded":
        return f"tanh of a normal, 0 ± {prior.scale:.3g}"
    if prior.kind == "normal":
        return f"normal, {prior.centre:.3g} ± {prior.scale:.3g}"
    return f"lognormal, median {prior.centre:.2g}, 95 % from {low:.2g} to {high:.2g}"


if __name__ == "__main__":
    for path in sorted(FOLDER.parent.rglob("*.md")):
        page = path.read_text()
        if (filled := fill(page)) != page:
            path.write_text(filled)
