# One job trains one network on all seeds of a dataset: importing torch costs seconds a job.
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
        trainings=1,  # `--resources trainings=N` limits how many share a GPU
    params:
        seeds=config["seeds"],
        settings=lambda wildcards: config["training"][
            ARCHITECTURES[wildcards.architecture].family
        ],
        gpu=config["training"]["gpu"],
        precision=config["training"]["precision"],
        learnt_share=learnt_share_of,
        cylinder=cylinder_class_of,
    script:
        "../scripts/train.py"
