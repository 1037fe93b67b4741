"""The library of faults and users' own."""

import pytest

from rippletwin.diagnosis.faults.base import Fault
from rippletwin.diagnosis.faults.library import (
    FAULTS,
    select_faults,
    state_name,
    states_of,
)
from rippletwin.errors import InputError
from rippletwin.pump.faults import Cylinder, Slipper

OWN = """
from rippletwin.diagnosis.faults.base import Fault
from rippletwin.pump.faults import Slipper

FAULT = Fault("{name}", "two worn slippers", lambda area, piston, pistons: [
    Slipper(area, piston), Slipper(area, piston + 1)], "a user")
"""

SINGLE = """
from rippletwin.diagnosis.faults.base import Fault
from rippletwin.pump.faults import Slipper

FAULT = Fault("single", "one worn slipper", lambda area, piston, pistons: {}, "a user")
"""


def test_the_library_has_the_contract_s_faults():
    """Slipper and cylinder are tried by default, in that order; the valve plate on demand."""
    assert [f.name for f in select_faults()] == ["slipper", "cylinder"]
    assert [f.name for f in select_faults(["valve_plate"])][-1] == "valve_plate"
    assert FAULTS["slipper"].leaks(1e-7, 3, 9) == [Slipper(1e-7, 3)]
    assert FAULTS["cylinder"].leaks(1e-7, 3, 9) == [Cylinder(1e-7, 3)]


def test_a_worn_valve_plate_shares_its_leak_among_all_pistons():
    """All chambers leak alike, together through the whole area."""
    leaks = FAULTS["valve_plate"].leaks(9e-7, 0, 9)
    assert {leak.piston for leak in leaks} == set(range(9))
    assert sum(leak.leak_area for leak in leaks) == pytest.approx(9e-7)


def test_states_are_named_as_in_the_contract():
    """Healthy, each fault alone, both."""
    names = [state_name(state) for state in states_of(select_faults())]
    assert names == ["healthy", "slipper", "cylinder", "slipper+cylinder"]


def test_a_user_s_file_is_a_fault(tmp_path):
    """A file outside the library that defines FAULT is tried beside the library's own."""
    path = tmp_path / "pair.py"
    path.write_text(OWN.format(name="pair"))
    found = select_faults([path])
    assert [f.name for f in found] == ["slipper", "cylinder", "pair"]
    assert len(found[-1].leaks(1e-7, 0, 9)) == 2


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (None, "neither a known fault nor a file"),
        ("FAULT = 1", "no Fault"),
        ("raise RuntimeError('broken')", "broken"),
        (OWN.format(name="slipper"), "a second fault"),
        (OWN.format(name="healthy"), "a fault cannot be called"),
        (OWN.format(name="slipper+cylinder"), "a fault cannot be called"),
        (OWN.format(name="own").replace("piston + 1", "1 / 0"), "leaks: fails: ZeroDivision"),
        (SINGLE.format("Slipper(area, piston)"), "leaks: fails: .*not iterable"),
        (SINGLE.format("[area]"), "1e-07 is no leak of the pump model"),
        (SINGLE.format("[]"), "gives no leak"),
    ],
)
def test_a_file_that_is_no_fault_is_bad_input(tmp_path, content, words):
    """The message names the file and what is wrong with it."""
    path = tmp_path / "own.py"
    if content is not None:
        path.write_text(content)
    with pytest.raises(InputError, match=words) as error:
        select_faults([path])
    assert error.value.file == str(path)


def test_a_prior_that_is_none_is_refused():
    """Smallest and largest leak in the wrong order."""
    with pytest.raises(ValueError, match="smallest"):
        Fault("x", "x", lambda *_: [], "x", smallest=1e-6, largest=1e-8)
