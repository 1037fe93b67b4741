# Trained networks -> what they say of every recorded window.
rule evaluate:
    input:
        recorded=recorded_of,
        weights=rules.train.output.weights,
        source=scripts_sources("evaluate.py"),
    output:
        f"{RESULTS}/predictions/{{dataset}}/{{architecture}}.csv",
    log:
        f"{RESULTS}/logs/evaluate/{{dataset}}/{{architecture}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/evaluate/{{dataset}}/{{architecture}}.tsv"
    priority: 30
    resources:
        mem_mb=3000,
    params:
        gpu=config["training"]["gpu"],
        learnt_share=learnt_share_of,
    script:
        "../scripts/evaluate.py"
