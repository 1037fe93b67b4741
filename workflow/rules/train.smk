# One job trains one network on all seeds of a dataset: importing torch costs seconds a job.
from rippletwin.learning.architectures import LONGEST_TRAININGS


def samples_of(wildcards):
    """What a network learns from: a store a seed, or the recordings."""
    if DATASETS[wildcards.dataset].line == "rig":
        return recorded_of(wildcards)
    return for_network(
        wildcards,
        every_seed("samples/{dataset}/single/{seed}x1.zarr"),
        every_seed("images/{dataset}/single/{seed}.zarr"),
    )


def priority_of(wildcards):
    """Start the longest trainings first."""
    name = wildcards.architecture
    return 20 - LONGEST_TRAININGS.index(name) if name in LONGEST_TRAININGS else 10


def cylinder_class_of(wildcards):
    """Class of a recorded cylinder fault where networks learn from recordings, as in scoring."""
    dataset = DATASETS[wildcards.dataset]
    return config["scoring"][dataset.signal] if dataset.line == "rig" else None


rule train:
    input:
        samples=samples_of,
        source=scripts_sources("train.py"),
    output:
        weights=temp(f"{RESULTS}/models/{{dataset}}/{{architecture}}.pt"),
        history=f"{RESULTS}/models/{{dataset}}/{{architecture}}.json",
    log:
        f"{RESULTS}/logs/train/{{dataset}}/{{architecture}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/train/{{dataset}}/{{architecture}}.tsv"
    priority: priority_of
    resources:
        mem_mb=4000,
    params:
        seeds=config["seeds"],
        settings=lambda wildcards: config["training"][
            ARCHITECTURES[wildcards.architecture].family
        ],
        learnt_share=learnt_share_of,
        cylinder=cylinder_class_of,
    script:
        "../scripts/train.py"
