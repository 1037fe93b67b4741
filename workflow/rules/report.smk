# Predictions -> the accuracy table beside the paper's, and confusion matrices.
rule report:
    input:
        predictions=expand(
            f"{RESULTS}/predictions/{{dataset}}/{{architecture}}.csv",
            dataset=config["datasets"],
            architecture=config["architectures"],
        ),
        histories=expand(
            f"{RESULTS}/models/{{dataset}}/{{architecture}}.json",
            dataset=config["datasets"],
            architecture=config["architectures"],
        ),
        recorded=rules.ingest.output.windows,
        paper=PAPER,
        source=library("report.py"),
    output:
        table=report(
            f"{RESULTS}/accuracy.csv",
            category="accuracy",
            caption="../report/accuracy.rst",
        ),
        page=f"{RESULTS}/accuracy.md",
    log:
        f"{RESULTS}/logs/report.log",
    benchmark:
        f"{RESULTS}/benchmarks/report.tsv"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        severity=config["scoring"],
        recordings="the virtual rig's" if RECORDED_HERE else f"those of {CASE}",
        cells=[
            (dataset, architecture)
            for dataset in config["datasets"]
            for architecture in config["architectures"]
        ],
    script:
        "../scripts/report.py"


rule report_cost:
    input:
        table=rules.report.output.table,
        verdict=rules.explain.output.verdict,
        twin=rules.explain.output.twin,
        source=library("report_cost.py"),
    output:
        report(
            f"{RESULTS}/cost_of_missing_physics.md",
            category="accuracy",
            caption="../report/cost.rst",
        ),
    log:
        f"{RESULTS}/logs/report_cost.log",
    benchmark:
        f"{RESULTS}/benchmarks/report_cost.tsv"
    threads: 1
    resources:
        mem_mb=1000,
    script:
        "../scripts/report_cost.py"


rule plot_confusion:
    input:
        table=rules.report.output.table,
        source=library("plot_confusion.py"),
    output:
        png=report(
            f"{RESULTS}/figures/confusion_{{dataset}}.png",
            category="confusion matrices",
            caption="../report/confusion.rst",
        ),
        svg=f"{RESULTS}/figures/confusion_{{dataset}}.svg",
    log:
        f"{RESULTS}/logs/plot_confusion/{{dataset}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/plot_confusion/{{dataset}}.tsv"
    threads: 1
    resources:
        mem_mb=1000,
    script:
        "../scripts/plot_confusion.py"


rule plot_accuracy:
    input:
        table=rules.report.output.table,
        paper=PAPER,
        source=library("plot_accuracy.py"),
    output:
        png=report(
            f"{RESULTS}/figures/accuracy.png",
            category="accuracy",
            caption="../report/accuracy.rst",
        ),
        svg=f"{RESULTS}/figures/accuracy.svg",
    log:
        f"{RESULTS}/logs/plot_accuracy.log",
    benchmark:
        f"{RESULTS}/benchmarks/plot_accuracy.tsv"
    threads: 1
    resources:
        mem_mb=1000,
    script:
        "../scripts/plot_accuracy.py"


rule plot_seeds:
    input:
        rig=rig_sheet(),
        seeds=f"{RESULTS}/seeds/{{dataset}}.zarr",
        reference=reference_of,
        source=library("plot_seeds.py"),
    output:
        ripple=report(
            f"{RESULTS}/figures/seeds_{{dataset}}.png",
            category="simulated signals",
            caption="../report/seeds.rst",
        ),
        ripple_svg=f"{RESULTS}/figures/seeds_{{dataset}}.svg",
        sst=report(
            f"{RESULTS}/figures/sst_{{dataset}}.png",
            category="simulated signals",
            caption="../report/sst.rst",
        ),
        sst_svg=f"{RESULTS}/figures/sst_{{dataset}}.svg",
    log:
        f"{RESULTS}/logs/plot_seeds/{{dataset}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/plot_seeds/{{dataset}}.tsv"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        rig=rig_sections("pump"),
        min_frequency_hz=config["sst"]["min_frequency_hz"],
        max_frequency_hz=config["sst"]["max_frequency_hz"],
        voices=config["sst"]["voices"],
        k=config["sst"]["k"],
    script:
        "../scripts/plot_seeds.py"
