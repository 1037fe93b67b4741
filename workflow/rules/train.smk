# One job trains one network on all seeds of a dataset: importing torch costs seconds a job.
rule train:
    input:
        samples=samples_of,
        source=library("train.py"),
    output:
        weights=temp(f"{RESULTS}/models/{{dataset}}/{{architecture}}.pt"),
        history=f"{RESULTS}/models/{{dataset}}/{{architecture}}.json",
    log:
        f"{RESULTS}/logs/train/{{dataset}}/{{architecture}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/train/{{dataset}}/{{architecture}}.tsv"
    priority: urgency_of
    threads: 1
    resources:
        mem_mb=4000,
    params:
        seeds=config["seeds"],
        settings=lambda wildcards: config["training"][family_of(wildcards.architecture)],
        share=config["experimental"]["training_share"],
        cylinder=config["scoring"]["pressure"],
    script:
        "../scripts/train.py"
