"""A twin as plain lists, numbers and text, for a JSON file, and back."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path

import numpy as np

from rippletwin.case.model import Fluid, Load, Rig, Segment, Sensor, Uncertainty
from rippletwin.errors import InputError
from rippletwin.spectra.corrected_ripple import CorrectedRipple
from rippletwin.twin.effects.base import Effect, Place
from rippletwin.twin.effects.library import add_effects, find_effect
from rippletwin.twin.operating_point import OperatingCondition
from rippletwin.twin.twin import Twin


def to_dict(twin: Twin) -> dict:
    """Plain data of a twin; `values` is for readers, all else is what `from_dict` reads."""
    rig = asdict(twin.rig)
    for key in ("frequency_hz", "impedance"):
        rig["load"][key] = _plain(rig["load"][key])
    return {
        "rig": rig,
        "recordings": list(twin.labels),
        "friction": twin.friction,
        "source_sd": twin.source_sd,
        "guessed_load": twin.guessed_load,
        "absolute_gains": twin.absolute_gains,
        "uncertain_pump": twin.uncertain_pump,
        "changing_state": twin.changing_state,
        "effects": [_effect(e, place) for e, place in twin.effects],
        "theta": twin.theta.tolist(),
        "flow_ripple": None if twin.ripple is None else twin.ripple.as_dict(),
        "values": twin.values(),
    }


def from_dict(data: dict) -> Twin:
    """The twin that `to_dict` wrote.

    Raises InputError where it has an effect of a user's file that this process does not know, or
    parameters of another version.
    """
    twin = Twin(
        _rig(data["rig"]),
        [OperatingCondition(label) for label in data["recordings"]],
        friction=data["friction"],
        effects=[
            (find_effect(e["name"], e.get("file")), Place(**e["place"])) for e in data["effects"]
        ],
        source_sd=data["source_sd"],
        guessed_load=data["guessed_load"],
        absolute_gains=data.get("absolute_gains"),
        uncertain_pump=data.get("uncertain_pump", False),
        changing_state=data.get("changing_state", False),
        ripple=CorrectedRipple.from_dict(ripple) if (ripple := data.get("flow_ripple")) else None,
    )
    _check_parameters(twin, data["values"])
    return twin.with_(theta=np.array(data["theta"]))


def _check_parameters(twin: Twin, values: dict) -> None:
    """Raise InputError where the parameters of a file's twin are not those of this version."""
    if different := sorted(twin.index.keys() ^ values.keys()):
        raise InputError(
            "twin.json",
            "twin.values",
            f"are those of another version of rippletwin ({', '.join(different)})",
            "Run calibrate or explain again",
        )


def _effect(effect: Effect, place: Place) -> dict:
    """An effect at its place; of a user's effect also the name of its file."""
    data = {"name": effect.name, "place": asdict(place)}
    return data if effect.file is None else {**data, "file": Path(effect.file).name}


def _rig(data: dict) -> Rig:
    load = dict(data["load"])
    for key in ("frequency_hz", "impedance"):
        load[key] = _array(load[key])
    return Rig(
        fluid=Fluid(**data["fluid"]),
        pump=data["pump"],
        line=tuple(Segment(**s) for s in data["line"]),
        sensors=tuple(Sensor(**s) for s in data["sensors"]),
        load=Load(**load),
        uncertainty=Uncertainty(**data["uncertainty"]),
        displacement=data.get("displacement"),
        tolerance_scale=data.get("tolerance_scale", 1.0),
    )


def _plain(values: np.ndarray | None):
    if values is None or not np.iscomplexobj(values):
        return None if values is None else values.tolist()
    return {"re": values.real.tolist(), "im": values.imag.tolist()}


def _array(values):
    if isinstance(values, dict):
        return np.array(values["re"]) + 1j * np.array(values["im"])
    return None if values is None else np.array(values)


def twin_of(data: dict) -> Twin:
    """The twin in what `to_dict` made, or in what `to_dict` did."""
    return from_dict(data.get("twin", data))


def load_covariance(path: str | Path) -> np.ndarray | None:
    """Posterior covariance (P, P) of a twin.json's theta; None where the file has none."""
    data = json.loads(Path(path).read_text())
    return np.array(data["covariance"]) if "covariance" in data else None


def load_twin(path: str | Path, effects: Iterable[str | Path] = ()) -> Twin:
    """The twin of a twin.json, that of a calibration or the corrected one of `explain`.

    effects   users' files that define effects of the twin

    Raises InputError where the file cannot be read, holds no twin, or has an effect of a user's
    file that is not given.
    """
    add_effects(effects)
    try:
        return twin_of(json.loads(Path(path).read_text()))
    except InputError as error:
        raise InputError(path, error.field, error.problem, error.remedy) from None
    except OSError as error:
        problem = f"cannot be read ({error.strerror})"
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        problem = f"holds no twin ({error!r})"
    raise InputError(path, "twin", problem, "Give a twin.json as calibrate or explain writes it")
