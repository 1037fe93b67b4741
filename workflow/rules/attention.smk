# Trained networks -> what they look at, whether that tells which to choose, the paper's claims.
rule probe:
    input:
        signals=f"{RESULTS}/seeds/{{dataset}}.zarr",
        source=library("probe.py"),
    output:
        directory(f"{RESULTS}/samples/{{dataset}}/probex{{revolutions}}.zarr"),
    log:
        f"{RESULTS}/logs/probe/{{dataset}}/{{revolutions}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/probe/{{dataset}}/{{revolutions}}.tsv"
    threads: 1
    resources:
        mem_mb=1000,
    script:
        "../scripts/probe.py"


rule attention:
    input:
        probes=probes_of,
        recorded=recorded_of,
        weights=rules.train.output.weights,
        source=library("attention.py"),
    output:
        directory(f"{RESULTS}/attention/{{dataset}}/{{architecture}}.zarr"),
    log:
        f"{RESULTS}/logs/attention/{{dataset}}/{{architecture}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/attention/{{dataset}}/{{architecture}}.tsv"
    priority: 30
    threads: 1
    resources:
        mem_mb=2000,
    script:
        "../scripts/attention.py"


rule attention_table:
    input:
        attention=expand(
            rules.attention.output,
            dataset=simulated(),
            architecture=config["architectures"],
        ),
        table=rules.report.output.table,
        source=library("attention_table.py"),
    output:
        table=report(
            f"{RESULTS}/attention.csv",
            category="attention",
            caption="../report/attention.rst",
        ),
        ranks=report(
            f"{RESULTS}/attention_ranks.csv",
            category="attention",
            caption="../report/attention_ranks.rst",
        ),
        page=f"{RESULTS}/attention.md",
    log:
        f"{RESULTS}/logs/attention_table.log",
    benchmark:
        f"{RESULTS}/benchmarks/attention_table.tsv"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        cells=[
            (dataset, architecture)
            for dataset in simulated()
            for architecture in config["architectures"]
        ],
    script:
        "../scripts/attention_table.py"


rule plot_ranks:
    input:
        table=rules.attention_table.output.table,
        source=library("plot_ranks.py"),
    output:
        png=report(
            f"{RESULTS}/figures/attention_ranks.png",
            category="attention",
            caption="../report/attention_ranks.rst",
        ),
        svg=f"{RESULTS}/figures/attention_ranks.svg",
    log:
        f"{RESULTS}/logs/plot_ranks.log",
    benchmark:
        f"{RESULTS}/benchmarks/plot_ranks.tsv"
    threads: 1
    resources:
        mem_mb=1000,
    script:
        "../scripts/plot_ranks.py"


rule plot_attention:
    input:
        attention=lambda wildcards: expand(
            rules.attention.output,
            dataset=wildcards.dataset,
            architecture=of_domain(wildcards.domain),
        ),
        rig=rig_sheet(),
        source=library("plot_attention.py"),
    output:
        simulated=report(
            f"{RESULTS}/figures/attention_{{dataset}}_{{domain}}_simulated.png",
            category="attention",
            caption="../report/attention_simulated.rst",
        ),
        simulated_svg=f"{RESULTS}/figures/attention_{{dataset}}_{{domain}}_simulated.svg",
        recorded=report(
            f"{RESULTS}/figures/attention_{{dataset}}_{{domain}}_recorded.png",
            category="attention",
            caption="../report/attention_recorded.rst",
        ),
        recorded_svg=f"{RESULTS}/figures/attention_{{dataset}}_{{domain}}_recorded.svg",
    log:
        f"{RESULTS}/logs/plot_attention/{{dataset}}_{{domain}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/plot_attention/{{dataset}}_{{domain}}.tsv"
    wildcard_constraints:
        domain="time|image",
    threads: 1
    resources:
        mem_mb=1000,
    params:
        architectures=lambda wildcards: of_domain(wildcards.domain),
        rig=rig_sections("pump"),
        sst=config["sst"],
    script:
        "../scripts/plot_attention.py"


rule claims:
    input:
        table=rules.report.output.table,
        paper=PAPER,
        rig=rig_sheet(),
        source=library("claims.py"),
    output:
        table=report(
            f"{RESULTS}/claims.csv",
            category="claims",
            caption="../report/claims.rst",
        ),
        comparisons=f"{RESULTS}/claims_compared.csv",
        page=f"{RESULTS}/claims.md",
        png=report(
            f"{RESULTS}/figures/claims.png",
            category="claims",
            caption="../report/claims.rst",
        ),
        svg=f"{RESULTS}/figures/claims.svg",
    log:
        f"{RESULTS}/logs/claims.log",
    benchmark:
        f"{RESULTS}/benchmarks/claims.tsv"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        rig=rig_sections("pump"),
        samples_per_revolution=config["windows"]["samples_per_revolution"],
    script:
        "../scripts/claims.py"


rule compare_sst:
    input:
        seeds=expand(f"{RESULTS}/seeds/{{dataset}}.zarr", dataset=pressures()),
        recorded=rules.ingest.output.windows,
        rig=rig_sheet(),
        source=library("compare_sst.py"),
    output:
        table=report(
            f"{RESULTS}/similarity.csv",
            category="simulated signals",
            caption="../report/similarity.rst",
        ),
        png=report(
            f"{RESULTS}/figures/sst_compared.png",
            category="simulated signals",
            caption="../report/similarity.rst",
        ),
        svg=f"{RESULTS}/figures/sst_compared.svg",
    log:
        f"{RESULTS}/logs/compare_sst.log",
    benchmark:
        f"{RESULTS}/benchmarks/compare_sst.tsv"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        datasets=pressures(),
        rig=rig_sections("pump"),
        sst=config["sst"],
    script:
        "../scripts/compare_sst.py"
