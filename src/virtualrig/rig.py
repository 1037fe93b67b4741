"""A rig, built from its data sheet (what its owner knows) and its seal (what it really is)."""

import inspect
import re
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import yaml

from virtualrig.effects import EFFECTS, Draft
from virtualrig.faults import Leak
from virtualrig.network import Network, Node, Pipe
from virtualrig.pump import Pump

SHEET = Path(__file__).with_name("sheet.yaml")
SEAL = Path(__file__).with_name("sealed.yaml")


class RigError(ValueError):
    """A wrong data sheet, seal or command; the message names file and field."""


@dataclass(frozen=True)
class Sensing:
    """Response of a sensor: gain, delay in s, resonance (Hz, damping ratio)."""

    gain: float = 1.0
    delay: float = 0.0
    resonance: tuple[float, float] | None = None


@dataclass(frozen=True)
class Rig:
    """The true rig; the load's orifice is set by the operator, so its node has none yet.

    `noise` Pa rms; `speed_error` and `load_pressure_error` relative standard deviations of what the
    operator sets; `wander` relative standard deviation of the slow speed over a long time,
    correlated over `correlation_s`: less within a recording, whose mean is taken off; `ripple` rows
    (order, relative amplitude of crank speed, phase).
    """

    pump: Pump
    network: Network
    load_node: int
    faults: dict[str, Leak]
    sensing: tuple[Sensing, ...]
    noise: float = 0.0
    speed_error: float = 0.0
    wander: float = 0.0
    correlation_s: float = 3.0
    load_pressure_error: float = 0.0
    ripple: tuple[tuple[float, float, float], ...] = ()


class _Loader(yaml.SafeLoader):
    """Reads 9.5e6 as a number; YAML 1.1, which PyYAML follows, requires 9.5e+6."""


_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float", re.compile(r"[-+]?\d+(\.\d*)?[eE][-+]?\d+$"), list("-+0123456789")
)


def read_yaml(path: Path | str) -> dict:
    """A YAML mapping; raises RigError naming the file where it is missing or not one."""
    try:
        content = yaml.load(Path(path).read_text(), Loader=_Loader)
    except UnicodeDecodeError:
        raise RigError(f"{path}: not text; give a YAML file") from None
    except OSError as error:
        raise RigError(f"{path}: cannot be read ({error.strerror}); give a YAML file") from None
    except yaml.YAMLError as error:
        raise RigError(f"{path}: not readable as YAML ({error})") from None
    if not isinstance(content, dict):
        raise RigError(f"{path}: expected keys and values, found {type(content).__name__}")
    return content


def read_rig(sheet: Path | str = SHEET, seal: Path | str = SEAL) -> tuple[dict, Rig]:
    """The data sheet as it goes into rig.yaml, and the true rig. Raises RigError."""
    known, true = read_yaml(sheet), read_yaml(seal)
    try:
        return known, build(known, true)
    except (KeyError, TypeError, ValueError, IndexError, AttributeError) as error:
        what = f"{error.args[0]!r} is missing" if isinstance(error, KeyError) else error
        raise RigError(f"{seal} with {sheet}: {what}") from error


def build(known: dict, true: dict) -> Rig:
    """The rig of two mappings laid out like sheet.yaml and sealed.yaml.

    Without an entry in the seal, fluid, line and sensors are those of the data sheet. Raises
    ValueError, KeyError or TypeError for entries that are wrong, missing or unknown.
    """
    fluid = known["fluid"] | true.get("fluid", {})
    differs = true.get("pump", {})
    geometry = Pump(**known.get("pump", {}))
    pump = geometry.changed(differs.get("relative", {}), differs.get("timing_deg", 0.0))
    pump = replace(pump, **differs.get("values", {}))
    line = true.get("line", known["line"])
    sensors = true.get("sensors", [sensor["position"] for sensor in known["sensors"]])
    draft = Draft(pump, [dict(segment) for segment in line["segments"]], [{} for _ in sensors])
    for effect in true.get("effects", []):
        arguments = {key: value for key, value in effect.items() if key != "name"}
        apply_effect(draft, effect["name"], arguments)
    network, load_node = lay_out(draft, sensors, fluid, true.get("numerics", {}))
    speed = true.get("speed", {})
    return Rig(
        pump=draft.pump,
        network=network,
        load_node=load_node,
        faults={kind: Leak(kind, **fault) for kind, fault in true.get("faults", {}).items()},
        sensing=tuple(Sensing(**chain) for chain in draft.sensing),
        noise=true.get("noise", 0.0),
        speed_error=speed.get("error", 0.0),
        wander=speed.get("wander", 0.0),
        correlation_s=speed.get("correlation_s", 3.0),
        load_pressure_error=true.get("load_pressure_error", 0.0),
        ripple=tuple(draft.ripple),
    )


def apply_effect(draft: Draft, name: str, arguments: dict) -> None:
    """Add effect `name` to the draft; raises ValueError naming what is unknown or out of range."""
    if name not in EFFECTS:
        raise ValueError(f"effect {name!r} is unknown; known are {', '.join(sorted(EFFECTS))}")
    takes = list(inspect.signature(EFFECTS[name]).parameters)[1:]
    unknown = set(arguments) - set(takes)
    if unknown:
        raise ValueError(f"effect {name} takes {takes}, not {sorted(unknown)}")
    EFFECTS[name](draft, **arguments)


def lay_out(draft: Draft, sensors: list[float], fluid: dict, numerics: dict) -> tuple[Network, int]:
    """The draft's line, divided at its fittings into pipes and nodes, and the load's node."""
    ends = np.cumsum([segment["length"] for segment in draft.segments])
    places = sorted({0.0, *map(float, ends), *(float(at) for at, _ in draft.fittings)})
    merged = [places[0]]
    for place in places[1:]:
        if place - merged[-1] > 1e-6:
            merged.append(place)
    places = np.array(merged)

    def node_at(position: float) -> int:
        return int(np.argmin(abs(places - position)))

    nodes = [Node() for _ in places]
    for position, elements in draft.fittings:
        nodes[node_at(position)] = _join(nodes[node_at(position)], elements)
    if any(v for k, v in vars(nodes[0]).items() if k != "volume" and v != getattr(Node(), k)):
        raise ValueError("only a volume can sit right at the pump outlet (position 0)")
    pipes = []
    for k, (a, b) in enumerate(pairwise(places)):
        segment = draft.segments[int(np.searchsorted(ends, 0.5 * (a + b)))]
        pipes.append(
            Pipe(**segment | {"length": b - a}, start=k, end=k + 1, friction=draft.friction)
        )
    for position, branch in draft.branches:
        nodes.append(Node())
        pipes.append(
            Pipe(**branch, start=node_at(position), end=len(nodes) - 1, friction=draft.friction)
        )
    taps = []
    for position in sensors:
        if not 0 <= position <= places[-1]:
            raise ValueError(
                f"sensor at {position} m is outside the line (0 to {places[-1]:.3f} m)"
            )
        pipe = min(int(np.searchsorted(places, position, side="right")) - 1, len(places) - 2)
        taps.append((pipe, float(position - places[pipe])))
    network = Network(
        tuple(pipes),
        tuple(nodes),
        tuple(taps),
        fluid["density"],
        fluid["kinematic_viscosity"],
        **numerics,
    )
    return network, len(places) - 1


def _join(node: Node, elements: dict) -> Node:
    """`node` with more elements. Volumes and leaks add up; other elements may occur once."""
    values = {}
    for name, value in elements.items():
        present, empty = getattr(node, name), getattr(Node(), name)
        if name in ("volume", "leak", "orifice"):
            value += present
        elif present != empty:
            raise ValueError(f"two effects both set {name} at one place; move one of them")
        values[name] = value
    return replace(node, **values)
