# Compound faults, which no network learnt -> what the networks say of them.
rule evaluate_compound:
    input:
        samples=compound_samples_of,
        weights=rules.train.output.weights,
        source=scripts_sources("evaluate_compound.py"),
    output:
        f"{RESULTS}/compound/{{dataset}}/{{architecture}}.csv",
    log:
        f"{RESULTS}/logs/evaluate_compound/{{dataset}}/{{architecture}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/evaluate_compound/{{dataset}}/{{architecture}}.tsv"
    priority: 30
    resources:
        mem_mb=3000,
    params:
        gpu=config["training"]["gpu"],
    script:
        "../scripts/evaluate_compound.py"


rule report_compound:
    input:
        answers=expand_outputs(
            rules.evaluate_compound.output,
            dataset=SIMULATED,
            architecture=config["architectures"],
        ),
        source=scripts_sources("report_compound.py"),
    output:
        report(
            f"{RESULTS}/compound.md",
            category="Compound faults",
            subcategory="Tables",
            labels={"result": "answers of the networks"},
            caption="../report/compound.rst",
        ),
    log:
        f"{RESULTS}/logs/report_compound.log",
    benchmark:
        f"{RESULTS}/benchmarks/report_compound.tsv"
    params:
        cells=cells(SIMULATED),
    script:
        "../scripts/report_compound.py"
