"""What is wrong with the pump in every recording that is not known to be healthy."""

from pathlib import Path

from job import open_log
from rippletwin.case.load import load_case
from rippletwin.diagnosis.diagnose import diagnose, select_recordings
from rippletwin.diagnosis.diagnosis_file import write_diagnosis
from rippletwin.diagnosis.faults.library import select_faults
from rippletwin.figures.fault_posterior import draw
from rippletwin.twin.twin_file import load_twin

report_progress = open_log(snakemake)
case = load_case(Path(snakemake.input.rig).parent)
labels = [r.label for r in case.recordings if r.state != "healthy" and r.kind == "periodic"]
diagnoses = diagnose(
    case,
    load_twin(snakemake.input.twin, snakemake.input.effects),
    select_recordings(case, labels),
    select_faults(snakemake.params.faults),
    lambda what, done, total: report_progress(f"{what}: {done} of {total}"),
)
folder = Path(snakemake.output.diagnosis).parent
result = write_diagnosis(diagnoses, folder)
draw(diagnoses, folder)
for each in result["recordings"]:
    report_progress(each["sentence"])
