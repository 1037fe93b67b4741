# Trained networks -> what they look at, and whether that tells which network to choose.
rule attention:
    input:
        probes=probes_of,
        recorded=recorded_of,
        weights=rules.train.output.weights,
        source=scripts_sources("attention.py"),
    output:
        directory(f"{RESULTS}/attention/{{dataset}}/{{architecture}}.zarr"),
    log:
        f"{RESULTS}/logs/attention/{{dataset}}/{{architecture}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/attention/{{dataset}}/{{architecture}}.tsv"
    priority: 30
    resources:
        mem_mb=3000,
    params:
        gpu=config["training"]["gpu"],
    script:
        "../scripts/attention.py"


rule attention_table:
    input:
        attention=expand_outputs(
            rules.attention.output,
            dataset=SIMULATED,
            architecture=config["architectures"],
        ),
        table=rules.accuracy_table.output.table,
        source=scripts_sources("attention_table.py"),
    output:
        table=report(
            f"{RESULTS}/attention.csv",
            category="Attention",
            subcategory="Tables",
            labels={"result": "attention of each network"},
            caption="../report/attention.rst",
        ),
        ranks=report(
            f"{RESULTS}/attention_ranks.csv",
            category="Attention",
            subcategory="Tables",
            labels={"result": "ranks of the networks"},
            caption="../report/attention_ranks.rst",
        ),
        page=f"{RESULTS}/attention.md",
    log:
        f"{RESULTS}/logs/attention_table.log",
    benchmark:
        f"{RESULTS}/benchmarks/attention_table.tsv"
    params:
        cells=cells(SIMULATED),
    script:
        "../scripts/attention_table.py"
