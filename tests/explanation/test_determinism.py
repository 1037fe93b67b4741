"""The same recordings give the same verdict, to the last digit."""

import json

import numpy as np
import pytest

from rippletwin.explanation.explain import explain_observations
from rippletwin.explanation.verdict.verdict_file import write_verdict
from synthetic_effects import TRUTH, VOLUME
from synthetic_observations import POINTS, make


@pytest.mark.long
def test_one_process_or_two_write_the_same_files(tmp_path):
    """verdict.json and twin.json of a line with a volume have the same bytes whether one process
    fits all hypotheses or two share them, and however often: no result depends on which job ends
    first, nor on what a process has kept of an earlier one."""
    rig, observations, _ = make(np.random.default_rng(2), VOLUME, TRUTH, 2, POINTS[:1])
    written = []
    for run, processes in enumerate((1, 2, 1)):
        explanation = explain_observations(rig, observations, processes=processes)
        write_verdict(explanation, tmp_path / str(run))
        written.append(
            [(tmp_path / str(run) / f).read_bytes() for f in ("verdict.json", "twin.json")]
        )
    assert json.loads(written[0][0])["effects"]
    assert written[0] == written[1] == written[2]
