"""What physics the twin lacks on the configured case: the same as `rippletwin explain`."""

from pathlib import Path

from job import open_log
from rippletwin.case.load import load_case
from rippletwin.explanation.explain import explain
from rippletwin.explanation.verdict.verdict_file import write_verdict
from rippletwin.figures.explanation import draw
from rippletwin.twin.effects.library import add_effects

report_progress = open_log(snakemake)
case = load_case(Path(snakemake.input.rig).parent, states={"healthy"})
for warning in case.warnings:
    report_progress(f"warning: {warning}")
add_effects(snakemake.input.effects, case.rig)
explanation = explain(
    case, snakemake.threads, lambda what, done, total: report_progress(f"{what}: {done} of {total}")
)
folder = Path(snakemake.output.verdict).parent
verdict = write_verdict(explanation, folder)
draw(explanation, folder, processes=snakemake.threads)
report_progress(verdict["sentence"])
