"""What `snakemake --report` shows of a finished run."""

import json
import zipfile

import pytest

from workflow_copy import snakemake


@pytest.fixture(scope="module")
def page(finished, tmp_path_factory) -> str:
    """The page of the packed report."""
    archive = tmp_path_factory.mktemp("report") / "report.zip"
    result = snakemake(finished, "--report", str(archive))
    assert result.returncode == 0, result.stderr
    return zipfile.ZipFile(archive).read("report/report.html").decode()


def variable(page: str, name: str) -> dict:
    """What the page's script reads under this name."""
    start = page.rindex(f"var {name} = ") + len(f"var {name} = ")
    return json.JSONDecoder().raw_decode(page, start)[0]


@pytest.fixture(scope="module")
def results(page) -> dict[str, dict]:
    """Path -> labels, caption and more."""
    return variable(page, "results")


@pytest.fixture(scope="module")
def places(page) -> dict[str, tuple[str, str]]:
    """Path -> category and subcategory."""
    return {
        path: (category, subcategory)
        for category, below in variable(page, "categories").items()
        for subcategory, paths in below.items()
        for path in paths
    }


def test_every_picture_and_table_is_in_the_report(finished, results):
    """Each picture, page and table that the run left, but no file of single networks."""
    out = finished / "out"
    shown = [*out.rglob("*.png"), *out.rglob("*.html"), *out.glob("*.csv")]
    stores = [path for path in out.rglob("*.zarr")]
    wanted = {
        path.relative_to(finished).as_posix()
        for path in shown
        if not any(store in path.parents for store in stores)
    }
    wanted |= {"out/explain/verdict.json", "out/diagnosis/diagnosis.json"}
    assert len(wanted) > 40
    assert wanted <= set(results)


def test_every_result_has_its_place_and_words(results, places):
    """A category, a subcategory, labels in words, and a caption: by them one finds it."""
    for path, result in results.items():
        assert all(place and place != "Other" for place in places[path]), path
        assert result["labels"], path
        assert "_" not in "".join(result["labels"].values()), path
        assert len(result["caption"]) > 20, path


def test_results_of_one_place_have_labels_of_their_own(results, places):
    """No two results of a subcategory have the same labels: a reader can tell them apart."""
    seen = [(*places[path], *result["labels"].items()) for path, result in results.items()]
    assert len(set(seen)) == len(seen)
