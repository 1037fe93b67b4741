# Trained networks -> what they say of every recorded window.
rule evaluate:
    input:
        recorded=recorded_of,
        weights=rules.train.output.weights,
        source=library("evaluate.py"),
    output:
        f"{RESULTS}/predictions/{{dataset}}/{{architecture}}.csv",
    params:
        share=config["experimental"]["training_share"],
    log:
        f"{RESULTS}/logs/evaluate/{{dataset}}/{{architecture}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/evaluate/{{dataset}}/{{architecture}}.tsv"
    conda:
        ENVIRONMENT
    threads: 1
    priority: 30
    resources:
        mem_mb=2000,
    script:
        "../scripts/evaluate.py"
