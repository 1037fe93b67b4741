"""What the kept networks say of the recordings of unknown state, as JSON and as a table."""

import json
from pathlib import Path

from job import open_log
from rippletwin import store
from rippletwin.case.diagnosed_point import unknown_recordings
from rippletwin.case.load import load_case, unread_recordings
from rippletwin.case.rig_yaml import read_sheet
from rippletwin.diagnosis.network_answers import ask_networks, read_networks
from rippletwin.learning.markdown import markdown_table

report_progress = open_log(snakemake)
rig = Path(snakemake.input.rig)
labels = [recording.label for recording in unknown_recordings(unread_recordings(read_sheet(rig)))]
case = load_case(rig.parent, labels=labels)
networks = read_networks(snakemake.input.networks, case.rig)
answers = ask_networks(networks, case.recordings, case.rig)
store.write_text(snakemake.output.answers, json.dumps(answers, indent=1) + "\n")
lines = [
    [label, name, said["state"], f"{100 * said['share']:.0f}", f"{100 * said['unlike']:.0f}"]
    for label, answer in answers.items()
    for name, said in answer.items()
]
store.write_text(
    snakemake.output.page,
    """# Recordings of unknown state, by networks

The state that most windows and seeds of a network say, and their share, per cent; the share that is
unlike everything simulated. A recording is called unlike where most of its windows are.

"""
    + markdown_table(["Recording", "Network", "state", "share", "unlike"], lines),
)
report_progress(f"{len(answers)} recordings, {len(networks)} networks")
