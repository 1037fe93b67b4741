"""Files that the commands write and read again, damaged at random: refused in words or used."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fuzzing import EDITS, TREE_EDITS, edited, edited_tree, little_memory, refused, tried
from made_results import quick_page, write_results
from noise_networks import kept, saved
from rippletwin.case.load import load_case
from rippletwin.errors import InputError
from rippletwin.learning.kept_networks import load_networks
from rippletwin.report.page import report_case
from rippletwin.twin.twin_file import load_twin

RESULTS = (
    "explained/verdict.json",
    "explained/twin.json",
    "explained/figures/explain.json",
    "diagnosed/diagnosis.json",
    "diagnosed/figures/diagnose.json",
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A case with results of explain and diagnose, of which pages are made quickly."""
    folder = write_results(tmp_path_factory.mktemp("case"))
    with quick_page(load_case(folder)):
        yield folder


def damaged(text: str, edits, tree, as_tree: bool) -> bytes:
    """JSON after edits of its tree, or of its bytes."""
    if as_tree:
        return json.dumps(edited_tree(json.loads(text), tree)).encode()
    return edited(text.encode(), edits)


@tried(1)
@given(edits=EDITS, tree=TREE_EDITS, as_tree=st.booleans())
def test_a_twin(folder, edits, tree, as_tree):
    """twin.json gives a twin, or is refused."""
    good = (folder / "explained" / "twin.json").read_text()
    path = folder / "twin.json"
    path.write_bytes(damaged(good, edits, tree, as_tree))
    try:
        with little_memory():
            load_twin(path)
    except InputError as error:
        assert refused(error)


@pytest.mark.parametrize("name", RESULTS)
@tried(0.3)
@given(edits=EDITS, tree=TREE_EDITS, as_tree=st.booleans())
def test_the_page_of_results(folder, name, edits, tree, as_tree):
    """Each file that the report shows: the page is written, or the file is refused."""
    path = folder / name
    good = path.read_text()
    path.write_bytes(damaged(good, edits, tree, as_tree))
    try:
        with little_memory():
            report_case(folder, folder / "report.html")
    except InputError as error:
        assert refused(error)
    finally:
        path.write_text(good)


class Networks:
    """A file of kept networks, and its good bytes."""

    def __init__(self, path):
        self.path, self.content = path, path.read_bytes()

    def __repr__(self):
        return self.path.name


@pytest.fixture(scope="module")
def networks(tmp_path_factory):
    return Networks(saved(tmp_path_factory.mktemp("results"), kept()))


@tried(0.3)
@given(edits=EDITS, head=st.sampled_from([None, 2000]))
def test_kept_networks(networks, edits, head):
    """A file of networks holds tensors and plain data, or is refused."""
    networks.path.write_bytes(edited(networks.content, edits, head))
    try:
        with little_memory():
            load_networks(networks.path)
    except InputError as error:
        assert refused(error)
