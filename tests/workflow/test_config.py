"""Schema, defaults and documentation of the configuration agree."""

import jsonschema
import pytest
import yaml

from paths import ROOT

SCHEMA = yaml.safe_load((ROOT / "workflow/schemas/config.schema.yaml").read_text())
DEFAULTS = yaml.safe_load((ROOT / "config/config.yaml").read_text())


def leaves(node: dict, path: tuple = ()) -> dict[str, str]:
    """Dotted key -> description, of everything below a node of the schema."""
    found = {}
    while set(node) == {"$ref"}:
        node = SCHEMA["$defs"][node["$ref"].rsplit("/", 1)[1]]
    if "properties" not in node:
        return {".".join(path): node["description"]}
    assert node["additionalProperties"] is False and set(node["required"]) == set(
        node["properties"]
    ), path
    for key, child in node["properties"].items():
        found |= leaves(child, (*path, key))
    return found


def values(node: dict, path: tuple = ()) -> dict[str, object]:
    """Dotted key -> value, of everything below a node of a configuration."""
    if not isinstance(node, dict):
        return {".".join(path): node}
    return {k: v for key, child in node.items() for k, v in values(child, (*path, key)).items()}


def merged(base, overlay):
    if not isinstance(overlay, dict):
        return overlay
    return base | {key: merged(base.get(key, {}), value) for key, value in overlay.items()}


def test_every_key_has_a_default_and_a_description():
    """Keys of the schema, which all must be given, are those of config.yaml."""
    assert set(leaves(SCHEMA)) == set(values(DEFAULTS))


def test_readme_has_a_row_for_every_key_and_no_other():
    """config/README.md shows each key with its default and the schema's description."""
    shown = [line for line in (ROOT / "config/README.md").read_text().splitlines() if "| `" in line]
    expected = []
    for key, description in leaves(SCHEMA).items():
        value = values(DEFAULTS)[key]
        text = ", ".join(map(str, value)) if isinstance(value, list) else value
        expected.append(f"| `{key}` | {text} | {description} |")
    assert shown == expected


@pytest.mark.parametrize("overlay", ["", "smoke.yaml", "paper.yaml", "severity.yaml"])
def test_configurations_are_valid(overlay):
    """The shipped overlays, laid over the defaults, satisfy the schema."""
    config = DEFAULTS
    if overlay:
        config = merged(config, yaml.safe_load((ROOT / "config" / overlay).read_text()))
    jsonschema.validate(config, SCHEMA)
    assert set(values(config)) == set(leaves(SCHEMA))


@pytest.mark.parametrize(
    "changes",
    [
        {"seeds": 0},
        {"sst": {"sise": 64}},
        {"noise": {"factor": -1}},
        {"training": {"plain": {"learning_rate": "fast"}}},
        {"colour": "blue"},
    ],
)
def test_wrong_values_and_unknown_keys_are_refused(changes):
    """The schema has teeth: each change makes the defaults invalid, and the message names it."""
    with pytest.raises(jsonschema.ValidationError) as caught:
        jsonschema.validate(merged(DEFAULTS, changes), SCHEMA)
    (key,) = values(changes)
    assert key.split(".")[-1] in f"{caught.value.json_path} {caught.value.message}"
