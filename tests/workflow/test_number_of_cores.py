"""On how many cores a run has run cannot be told from its results."""

import subprocess

import pytest

from run_results import final_results
from small_run import EVERY_STAGE, OVERLAY, start, write_case

# Snakemake's own hidden file in an output folder is no part of the store
pytestmark = pytest.mark.filterwarnings("ignore:.*snakemake_timestamp")


@pytest.mark.long
def test_one_core_and_two_give_the_same_results(tmp_path):
    """Two runs of every stage: one job after the other, and two at a time in another order. Every
    table, verdict, twin, diagnosis and store has the same bytes."""
    results = {}
    for cores in ("1", "2"):
        folder = tmp_path / cores
        folder.mkdir()
        (folder / "small.yaml").write_text(OVERLAY)
        write_case(folder / "case")
        with (folder / "printed").open("w") as printed:
            process = start(
                folder, EVERY_STAGE, "--cores", cores, stdout=printed, stderr=subprocess.STDOUT
            )
            assert process.wait() == 0, (folder / "printed").read_text()[-3000:]
        assert f"Provided cores: {cores}" in (folder / "printed").read_text()
        results[cores] = final_results(folder / "out")
    one, two = results["1"], results["2"]
    assert set(one) == set(two)
    assert [name for name in one if one[name] != two[name]] == []
