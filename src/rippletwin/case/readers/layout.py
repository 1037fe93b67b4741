"""Where in a file a recording is: what rig.yaml says of the file, and how a channel is chosen."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

import numpy as np

from rippletwin.case.pressure_units import PASCALS
from rippletwin.case.readers.file_checks import check_size
from rippletwin.case.readers.signals import numbers
from rippletwin.errors import InputError, raise_any

SAMPLES_BY_SENSORS = "samples_by_sensors"

KEYS = {"rate": "sampling_rate_name"}
"""Keys of rig.yaml that are called otherwise than the fields of a layout."""


@dataclass(frozen=True)
class Layout:
    """The rig's sensors and what rig.yaml says of a recording's file.

    sensors      names, in the rig's order
    dataset      name of the array; `pressure` where None. A group of a TDMS file
    orientation  of an array of two dimensions; None: the shorter one counts the sensors
    channels     sensor -> name or number (from 1) of its channel; its own name where absent
    time         name of the times, s; `time_s` where None
    rate         name under which the file states its sampling rate; `sampling_rate_hz` where None
    """

    sensors: tuple[str, ...]
    dataset: str | None = None
    orientation: str | None = None
    channels: Mapping[str, int | str] = field(default_factory=dict)
    time: str | None = None
    rate: str | None = None

    @classmethod
    def of(cls, sensors: Iterable[str], entry: Mapping) -> Layout:
        """The layout that a recording's entry of rig.yaml states."""
        return cls(
            sensors=tuple(sensors),
            dataset=entry.get("dataset"),
            orientation=entry.get("orientation"),
            channels={  # 2.0 is a whole number too
                sensor: int(channel) if isinstance(channel, float) else channel
                for sensor, channel in entry.get("channels", {}).items()
            },
            time=entry.get("time"),
            rate=entry.get("sampling_rate_name"),
        )

    @property
    def time_name(self) -> str:
        return self.time or "time_s"

    @property
    def rate_name(self) -> str:
        return self.rate or "sampling_rate_hz"

    def channel(self, sensor: str) -> int | str:
        """Name or number (from 1) of a sensor's channel."""
        return self.channels.get(sensor, sensor)

    @property
    def names(self) -> list[str]:
        """The channels that are chosen by name."""
        chosen = [self.channel(sensor) for sensor in self.sensors]
        return [name for name in chosen if isinstance(name, str)]


def choose(path: Path, layout: Layout, present: Sequence[str]) -> list[int]:
    """Positions, from 0, of the sensors' channels among those that a file names.

    Raises InputError for each sensor whose channel is absent, there more than once, or another
    sensor's too.
    """
    present = list(present)
    raise_any(filter(None, [_choice_error(path, layout, s, present) for s in layout.sensors]))
    chosen = [layout.channel(sensor) for sensor in layout.sensors]
    places = [c - 1 if isinstance(c, int) else present.index(c) for c in chosen]
    raise_any(
        InputError(
            path,
            sensor,
            f"its channel, number {place + 1} of the file, is that of "
            f"{layout.sensors[places.index(place)]} too",
            "Give each sensor its own channel",
        )
        for k, (sensor, place) in enumerate(zip(layout.sensors, places))
        if place in places[:k]
    )
    return places


def _choice_error(path: Path, layout: Layout, sensor: str, present: list[str]) -> InputError | None:
    chosen = layout.channel(sensor)
    if isinstance(chosen, int):
        return None if 1 <= chosen <= len(present) else number_error(path, sensor, len(present))
    count = present.count(chosen)
    if count == 1:
        return None
    if not count:
        return missing_sensor(path, layout, sensor, present)
    problem = f"two columns have this name: {chosen}"
    remedy = f"Rename one of them, or give the number of its column: channels: {{{sensor}: 2}}"
    return InputError(path, sensor, problem, remedy)


def find_time(path: Path, layout: Layout, present: Sequence[str]) -> int | None:
    """Position, from 0, of the times among the channels of a file; None where there are none.

    Raises InputError where rig.yaml names times that are not there.
    """
    present = list(present)
    if layout.time_name in present:
        return present.index(layout.time_name)
    if layout.time is not None:
        raise missing_name(path, "time", layout.time, present)
    return None


class ArrayLike(Protocol):
    """An array of a file or in memory; what is indexed is read."""

    shape: tuple[int, ...]

    def __getitem__(self, index): ...


def rows_of(
    path: Path, field: str, array: ArrayLike, layout: Layout, names: Sequence[str] | None
) -> np.ndarray:
    """The sensors' rows (S, N) of an array, `field`; no other row of it is read.

    names : of the array's channels, in their order; None where the file does not name them. Then
        the channels are those of the sensors, in the rig's order, unless rig.yaml numbers them.
    """
    shape = tuple(array.shape)
    if len(shape) not in (1, 2):
        raise InputError(
            path,
            field,
            f"has {len(shape)} dimensions, shape {shape}",
            "Store it as (sensors, samples) or (samples, sensors)",
        )
    turned = layout.orientation == SAMPLES_BY_SENSORS
    if layout.orientation is None:
        turned = len(shape) == 2 and shape[0] > shape[1]
    if len(shape) == 1:
        count, samples = 1, shape[0]
    else:
        count, samples = shape[::-1] if turned else shape
    chosen = _chosen_rows(path, field, shape, (count, samples), layout, names)
    check_size(path, field, len(chosen) * samples)
    rows = None
    for place, k in enumerate(chosen):
        row = numbers(
            path, field, array[:] if len(shape) == 1 else array[:, k] if turned else array[k]
        )
        rows = np.empty((len(chosen), samples), row.dtype) if rows is None else rows
        rows[place] = row
    return rows


def _chosen_rows(
    path: Path,
    field: str,
    shape: tuple[int, ...],
    size: tuple[int, int],
    layout: Layout,
    names: Sequence[str] | None,
) -> list[int]:
    """Which channels of an array of so many channels and samples are the sensors'."""
    count, samples = size
    if names is not None:
        if len(names) != count or len(set(names)) < len(names):
            raise InputError(
                path,
                "sensors",
                f"names {', '.join(names)} for {count} channel(s) of {field}",
                "Give each channel one name, in their order",
            )
        return choose(path, layout, names)
    if layout.channels:
        unnumbered = [s for s in layout.sensors if not isinstance(layout.channel(s), int)]
        raise_any(
            InputError(
                path,
                sensor,
                f"the {count} channels of {field} have no names",
                f"Give every sensor's number: channels: {{{sensor}: 1}}",
            )
            for sensor in unnumbered
        )
        return choose(path, layout, [""] * count)
    if count != len(layout.sensors):
        raise InputError(
            path,
            field,
            f"shape {shape}: {count} channel(s) of {samples} samples, but rig.yaml lists "
            f"{len(layout.sensors)} sensor(s)",
            f"Say which is which: channels: {{{layout.sensors[0]}: 1, ...}}, counted from 1"
            if count > len(layout.sensors)
            else "Take the missing sensors out of `sensors`, or add them to the file",
        )
    return list(range(count))


def missing_sensor(
    path: Path, layout: Layout, sensor: str, present: Iterable[object]
) -> InputError:
    """The error for a file that lacks the channel of a sensor, by name."""
    known = [str(other) for other in present]
    name = str(layout.channel(sensor))
    found = ", ".join(known) or "nothing"
    near = similar_name(name, known)
    hint = "Add it to the file"
    if near:
        quoted = near if near.replace("_", "").isalnum() else repr(near)
        hint = f"Did you mean {near}? Give channels: {{{sensor}: {quoted}}} in rig.yaml"
        unit = next((u for u in PASCALS if u.casefold() in _words(near[len(name) :])), None)
        hint += f" and unit: {unit}" if unit else ""
    called = "" if name == sensor else f" ({name})"
    return InputError(
        path,
        sensor,
        f"no data for this sensor{called}; the file has {found}",
        f"{hint}; or take the sensor out of `sensors`, or correct its name in rig.yaml",
    )


def number_error(path: Path, sensor: str, count: int) -> InputError:
    """The error for a channel's number that a file with `count` channels has not got."""
    return InputError(
        path,
        sensor,
        f"the file has {count} channel(s), counted from 1",
        f"Give the number of its channel: channels: {{{sensor}: 1}}",
    )


def missing_name(path: Path, key: str, name: str, present: Iterable[str]) -> InputError:
    """The error for a name that rig.yaml gives under `key` and a file has not got."""
    present = list(present)
    near = similar_name(name, present)
    hint = f"Did you mean {near}? " if near else ""
    return InputError(
        path,
        key,
        f"{name} is not in the file; it has {', '.join(present) or 'nothing'}",
        f"{hint}Correct {key} of this recording in rig.yaml",
    )


def similar_name(name: str, present: Iterable[str]) -> str | None:
    """The name among `present` that differs from `name` by case, spaces, a unit or a letter."""
    present = list(present)
    wanted = name.casefold()
    for other in present:
        plain = other.strip().casefold()
        rest = plain[len(wanted) : len(wanted) + 1]
        if plain.startswith(wanted) and not rest.isalnum() and other != name:
            return other
    return next(iter(difflib.get_close_matches(name, present, n=1, cutoff=0.7)), None)


def _words(text: str) -> list[str]:
    return "".join(c if c.isalnum() else " " for c in text.casefold()).split()
