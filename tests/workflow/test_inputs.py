"""Parameters of rules that do not depend on what a job does not use: an edit of it reruns nothing.

test_reruns has the dry runs; here the functions are called without Snakemake.
"""

from types import SimpleNamespace

import pytest

from paths import ROOT

FILE = ROOT / "workflow/rules/inputs.smk"
SENSOR = {"method": "spectral", "bandwidth_hz": 1500, "pinn": {"width": 32, "steps": 300}}
DATASETS = {name: SimpleNamespace(signal=name) for name in ("pressure", "flow")}


def functions(**sensor):
    """What rules/inputs.smk defines, for a configuration with these keys of the flow sensor."""
    names = {"config": {"flow_sensor": SENSOR | sensor}, "DATASETS": DATASETS}
    exec(compile(FILE.read_text(), FILE, "exec"), names)
    return SimpleNamespace(**names)


def test_the_band_of_the_flow_sensor_is_that_of_flow_alone():
    """A dataset of pressure has none, whatever the configuration says."""
    for band in (1500, 1200):
        bandwidth_of = functions(bandwidth_hz=band).bandwidth_of
        assert bandwidth_of(SimpleNamespace(dataset="flow")) == band
        assert bandwidth_of(SimpleNamespace(dataset="pressure")) is None


@pytest.mark.parametrize(("method", "width"), [("pinn", 32), ("spectral", None)])
def test_settings_of_a_network_are_those_of_its_method(method, width):
    """The spectral method has no network."""
    assert functions(method=method).pinn_setting("width") == width
