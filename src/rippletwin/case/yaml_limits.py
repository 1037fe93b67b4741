"""YAML from a user: safe types, bounded size, depth and aliases, numbers as people mean them.

YAML 1.1 has surprises that a data sheet must not contain: 9.5e6 is text, 1:30 is ninety (base 60),
010 is eight, 2020-01-01 is a date, and a few aliases of aliases expand to gigabytes. Here decimal
numbers are numbers, everything else is text, and what is too large is refused before it is built.
"""

from __future__ import annotations

import re
from pathlib import Path

import yaml

from rippletwin.errors import InputError

MAX_BYTES = 200_000
MAX_DEPTH = 20
MAX_NODES = 20_000  # with every alias counted as often as it is used
CHARACTERS_PER_NODE = 100  # longer text counts as so many nodes more
MAX_DIGITS = 308  # of an integer; beyond it a double cannot hold it

_NUMBER_CHARACTERS = list("-+0123456789.")
_INTEGER = re.compile(r"^[-+]?\d[\d_]*$")
_FLOAT = re.compile(r"^[-+]?(\d[\d_]*\.?[\d_]*|\.\d[\d_]*)([eE][-+]?\d+)?$")
_KEPT = ("bool", "null", "merge")  # of YAML's own rules for plain text
_TAG = "tag:yaml.org,2002:"

PLAINLY = "A sheet needs no more than its keys: write the values out plainly"


class Refused(yaml.MarkedYAMLError):
    """YAML that is well-formed, but not taken: the problem, where it is, and the remedy."""

    def __init__(self, problem: str, where, remedy: str):
        super().__init__(problem=problem, problem_mark=where.start_mark)
        self.remedy = remedy


class BadValue(yaml.YAMLError):
    """A tag that its value contradicts, or an escape of no character."""


class Loader(yaml.SafeLoader):
    """YAML as people write it: decimal numbers, text, lists and mappings, each key once."""

    yaml_implicit_resolvers = {  # noqa: RUF012
        first: [rule for rule in rules if rule[0].removeprefix(_TAG) in _KEPT]
        for first, rules in yaml.SafeLoader.yaml_implicit_resolvers.items()
    }
    yaml_constructors = {  # noqa: RUF012
        tag: constructor
        for tag, constructor in yaml.SafeLoader.yaml_constructors.items()
        if tag is None or tag.removeprefix(_TAG) in ("bool", "null", "str", "seq", "map")
    }

    def __init__(self, stream: object):
        super().__init__(stream)
        self._depth = self._nodes = 0
        self._sizes: dict[int, int] = {}  # of finished nodes, by identity

    def compose_node(self, parent, index):
        """The next node, counted before anything is built of it."""
        event, before = self.peek_event(), self._nodes
        self._depth += 1
        self._nodes += 1 + len(getattr(event, "value", "") or "") // CHARACTERS_PER_NODE
        if self._depth > MAX_DEPTH:
            raise Refused(f"nested more than {MAX_DEPTH} deep", event, PLAINLY)
        node = super().compose_node(parent, index)
        if isinstance(event, yaml.AliasEvent):
            if id(node) not in self._sizes:
                raise Refused(f"the alias *{event.anchor} contains itself", event, PLAINLY)
            self._nodes += self._sizes[id(node)]
        else:
            self._sizes[id(node)] = self._nodes - before
        if self._nodes > MAX_NODES:
            raise Refused(f"more than {MAX_NODES} values, aliases written out", event, PLAINLY)
        self._depth -= 1
        return node

    def construct_mapping(self, node, deep=False):
        """A mapping whose keys are text, each given once."""
        seen = set()
        for key, _ in node.value if isinstance(node, yaml.MappingNode) else ():
            if not isinstance(key, yaml.ScalarNode):
                raise Refused("a list or mapping stands as a key", key, "Give the key as a word")
            if key.value in seen:
                raise Refused(f"the key {key.value!r} is given twice", key, "Keep one of them")
            seen.add(key.value)
        return super().construct_mapping(node, deep)

    def construct_number(self, node):
        """An int or a float; one that a double cannot hold is infinite."""
        text = self.construct_scalar(node).replace("_", "")
        try:
            whole = _INTEGER.match(text) and len(text) <= MAX_DIGITS
            return int(text) if whole else float(text)
        except ValueError:
            raise Refused(f"{text!r} is not a number", node, "Give a decimal number") from None


for _tag, _pattern in (("int", _INTEGER), ("float", _FLOAT)):
    Loader.add_implicit_resolver(_TAG + _tag, _pattern, _NUMBER_CHARACTERS)
    Loader.add_constructor(_TAG + _tag, Loader.construct_number)


def parse_yaml(text: str) -> object:
    """The value of YAML text; raises yaml.YAMLError where it is malformed or beyond a limit."""
    try:
        return yaml.load(text, Loader=Loader)
    except (KeyError, ValueError, OverflowError) as error:  # which PyYAML leaves uncaught
        raise BadValue(f"not YAML: a tag or an escaped character is wrong ({error})") from error


def read_yaml(path: Path) -> object:
    """The value of a YAML file, numbers finite or infinite; raises InputError."""
    text = _text(path)
    try:
        value = parse_yaml(text)
    except yaml.reader.ReaderError as error:
        line = text.count("\n", 0, error.position) + 1
        problem = f"the character {chr(error.character)!r} cannot stand in a text file"
        raise InputError(path, f"line {line}", problem, "Remove it") from error
    except BadValue as error:
        remedy = "Correct the tag or the escaped character"
        raise InputError(path, "the whole file", str(error), remedy) from error
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        place = f"line {mark.line + 1}, column {mark.column + 1}" if mark else "the whole file"
        if isinstance(error, Refused):
            raise InputError(path, place, error.problem, error.remedy) from error
        problem = getattr(error, "problem", None) or str(error)
        remedy = "Correct the syntax there"
        if "'\\t'" in problem:
            problem, remedy = "a tab indents this line", "Indent with spaces, YAML allows no tabs"
        raise InputError(path, place, f"not YAML: {problem}", remedy) from error
    if value is None:
        raise InputError(
            path, "the whole file", "the file is empty", "Write fluid, line, load and recordings"
        )
    return value


def _text(path: Path) -> str:
    """The file's text: UTF-8, of at most MAX_BYTES."""
    try:
        size = path.stat().st_size
        raw = path.read_bytes() if size <= MAX_BYTES else b""
    except PermissionError as error:
        raise InputError(
            path, "the whole file", "you are not allowed to read it", "Correct its permissions"
        ) from error
    except OSError as error:
        raise InputError(
            path, "the whole file", f"cannot be read ({error})", "Copy it again"
        ) from error
    if size > MAX_BYTES:
        raise InputError(
            path,
            "the whole file",
            f"{size} bytes, more than the {MAX_BYTES} that a sheet may have",
            "Give recordings as files of their own, named in `recordings`",
        )
    if raw.startswith((b"\xff\xfe", b"\xfe\xff")) or b"\x00" in raw[:100]:
        raise InputError(
            path, "the whole file", "looks like UTF-16, not UTF-8", "Save it with encoding UTF-8"
        )
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        raise InputError(
            path,
            f"line {line}",
            f"the byte 0x{raw[error.start]:02x} is not UTF-8; it may be Latin-1 or Windows-1252",
            "Save it with encoding UTF-8",
        ) from error
