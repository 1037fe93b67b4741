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
