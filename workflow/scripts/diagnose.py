"""What is wrong with the pump in every recording that is not known to be healthy."""

import json
from pathlib import Path

from job import open_log
from rippletwin.case.load import load_case
from rippletwin.diagnosis.diagnose import select_recordings
from rippletwin.diagnosis.diagnosis_file import write_diagnosis
from rippletwin.diagnosis.faults.library import select_faults
from rippletwin.diagnosis.input_warnings import find_warnings
from rippletwin.diagnosis.kept_answers import diagnose_changed
from rippletwin.figures.fault_posterior import draw
from rippletwin.twin.twin_file import load_twin

report_progress = open_log(snakemake)
case = load_case(Path(snakemake.input.rig).parent)
labels = [r.label for r in case.recordings if r.state != "healthy" and r.kind == "periodic"]
folder = Path(snakemake.output.diagnosis).parent
twin = load_twin(snakemake.input.twin, snakemake.input.effects)
recordings = select_recordings(case, labels)
answers = diagnose_changed(
    case,
    twin,
    recordings,
    select_faults(snakemake.params.faults),
    folder,
    lambda what, done, total: report_progress(f"{what}: {done} of {total}"),
)
entries = [each.entry for each in answers]
verdict = json.loads(Path(snakemake.input.verdict).read_text())
warnings = find_warnings(case, twin, recordings, verdict)
result = write_diagnosis(entries, folder, warnings=warnings)
draw([each.numbers for each in answers], folder)
report_progress(f"{sum(each.kept for each in answers)} of {len(answers)} answers were kept")
for each in result["recordings"]:
    report_progress(each["sentence"])
