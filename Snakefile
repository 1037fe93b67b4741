# The DAG's front door: config, its schema, the stages, the targets.
from snakemake.utils import min_version

min_version("9.0")


configfile: "config/config.yaml"


# Used with --sdm apptainer only: apptainer build rippletwin.sif workflow/rippletwin.def
container: "rippletwin.sif"


# Its limit of jobs a second makes snakemake 9 look for work once a second for every job that it
# ever started or finished: half a core after a hundred jobs (snakemake pull request 3744).
onstart:
    if workflow.executor_plugin.common_settings.local_exec:
        workflow.scheduler.job_rate_limiter = None


include: "workflow/rules/common.smk"
include: "workflow/rules/inputs.smk"
include: "workflow/rules/recordings.smk"
include: "workflow/rules/calibrate.smk"
include: "workflow/rules/explain.smk"
include: "workflow/rules/diagnose.smk"
include: "workflow/rules/faults.smk"
include: "workflow/rules/propagate.smk"
include: "workflow/rules/flow_sensor.smk"
include: "workflow/rules/randomised.smk"
include: "workflow/rules/samples.smk"
include: "workflow/rules/images.smk"
include: "workflow/rules/train.smk"
include: "workflow/rules/networks.smk"
include: "workflow/rules/evaluate.smk"
include: "workflow/rules/compound.smk"
include: "workflow/rules/report.smk"
include: "workflow/rules/attention.smk"
include: "workflow/rules/claims.smk"
include: "workflow/rules/figures.smk"
include: "workflow/rules/concealed.smk"
include: "workflow/rules/diagnosis_trial.smk"


rule all:
    default_target: True
    input:
        get_final_output(),
