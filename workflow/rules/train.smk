# One job trains one network on all seeds of a dataset: importing torch costs seconds a job.
rule train:
    input:
        samples=samples_of,
        source=library("train.py"),
    output:
        weights=f"{RESULTS}/models/{{dataset}}/{{architecture}}.pt",
        history=f"{RESULTS}/models/{{dataset}}/{{architecture}}.json",
    params:
        seeds=config["seeds"],
        settings=lambda wildcards: config["training"][domain_of(wildcards.architecture)],
        share=config["experimental"]["training_share"],
        cylinder=config["scoring"]["pressure"],
    log:
        f"{RESULTS}/logs/train/{{dataset}}/{{architecture}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/train/{{dataset}}/{{architecture}}.tsv"
    conda:
        ENVIRONMENT
    threads: 1
    priority: urgency_of
    resources:
        mem_mb=4000,
    script:
        "../scripts/train.py"
