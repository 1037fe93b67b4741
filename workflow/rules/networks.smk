# Networks of randomised datasets -> files that `rippletwin diagnose` reads.
rule keep_networks:
    input:
        learnt=rules.randomised_signals.output.learnt,
        held_out=rules.randomised_signals.output.held_out,
        recorded=recorded_signal_of,
        weights=rules.train.output.weights,
        source=scripts_sources("keep_networks.py"),
    output:
        networks=f"{RESULTS}/networks/{{dataset}}/{{architecture}}.pt",
        rates=f"{RESULTS}/networks/{{dataset}}/{{architecture}}.csv",
    log:
        f"{RESULTS}/logs/keep_networks/{{dataset}}/{{architecture}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/keep_networks/{{dataset}}/{{architecture}}.tsv"
    priority: 30
    resources:
        mem_mb=3000,
    params:
        signal=lambda wildcards: DATASETS[wildcards.dataset].signal,
        gpu=config["training"]["gpu"],
        noise=config["noise"]["factor"],
        learnt_share=learnt_share_of,
    script:
        "../scripts/keep_networks.py"


rule unlike_table:
    input:
        rates=expand_outputs(
            rules.keep_networks.output.rates,
            dataset=RANDOMISED,
            architecture=of_domain("time"),
        ),
        recorded=rules.cut_windows.output.windows,
        source=scripts_sources("unlike_table.py"),
    output:
        page=report(
            f"{RESULTS}/unlike.md",
            category="Accuracy",
            subcategory="Tables",
            labels={"result": "recordings unlike the simulations"},
            caption="../report/unlike.rst",
        ),
    log:
        f"{RESULTS}/logs/unlike_table.log",
    benchmark:
        f"{RESULTS}/benchmarks/unlike_table.tsv"
    params:
        cells=cells(RANDOMISED, of_domain("time")),
    script:
        "../scripts/unlike_table.py"


# They are asked about recordings of unknown state: none of the scored networks is needed for that.
rule ask_networks:
    input:
        rig=rig_sheet(),
        recordings=recordings("unknown"),
        networks=expand_outputs(
            rules.keep_networks.output.networks,
            dataset=ASKED,
            architecture=of_domain("time"),
        ),
        source=scripts_sources("ask_networks.py"),
    output:
        answers=f"{RESULTS}/diagnosis/networks.json",
        page=report(
            f"{RESULTS}/diagnosis/networks.md",
            category="Diagnosis by networks",
            subcategory="Tables",
            labels={"result": "recordings of unknown state"},
            caption="../report/answers.rst",
        ),
    log:
        f"{RESULTS}/logs/ask_networks.log",
    benchmark:
        f"{RESULTS}/benchmarks/ask_networks.tsv"
    resources:
        mem_mb=2000,
    params:
        rig=rig_content("pump", "sensors", recordings="unknown"),
    script:
        "../scripts/ask_networks.py"
