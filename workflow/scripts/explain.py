"""What physics the twin lacks on the configured case: the same as `rippletwin explain`."""

from pathlib import Path

from job import start
from rippletwin.case import load_case
from rippletwin.explain.run import explain
from rippletwin.explain.verdict import write
from rippletwin.figures.explain import draw

tell = start(snakemake)
case = load_case(Path(snakemake.input.rig).parent, states={"healthy"})
explanation = explain(
    case, snakemake.threads, lambda what, done, total: tell(f"{what}: {done} of {total}")
)
folder = Path(snakemake.output.verdict).parent
verdict = write(explanation, folder)
draw(explanation, folder, processes=snakemake.threads)
tell(verdict["sentence"])
