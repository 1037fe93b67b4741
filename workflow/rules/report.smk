# Predictions -> the accuracy table beside the paper's, and what missing physics costs.
rule accuracy_table:
    input:
        predictions=expand_outputs(
            rules.evaluate.output,
            dataset=CHOSEN,
            architecture=config["architectures"],
        ),
        histories=expand_outputs(
            rules.train.output.history,
            dataset=CHOSEN,
            architecture=config["architectures"],
        ),
        paper=PAPER,
        source=scripts_sources("accuracy_table.py"),
    output:
        table=report(
            f"{RESULTS}/accuracy.csv",
            category="Accuracy",
            subcategory="Tables",
            labels={"result": "accuracy of every training"},
            caption="../report/trainings.rst",
        ),
        page=f"{RESULTS}/accuracy.md",
    log:
        f"{RESULTS}/logs/accuracy_table.log",
    benchmark:
        f"{RESULTS}/benchmarks/accuracy_table.tsv"
    params:
        severity=config["scoring"],
        recordings=WHOSE_RECORDINGS,
        cells=cells(CHOSEN),
        columns=table_columns(),
        signals={name: DATASETS[name].signal for name in CHOSEN},
        randomised=RANDOMISED,
    script:
        "../scripts/accuracy_table.py"


rule recording_table:
    input:
        predictions=expand_outputs(
            rules.evaluate.output,
            dataset=CHOSEN,
            architecture=config["architectures"],
        ),
        recorded=rules.cut_windows.output.windows,
        accuracy=rules.accuracy_table.output.table,
        source=scripts_sources("recording_table.py"),
    output:
        table=report(
            f"{RESULTS}/recordings.csv",
            category="Accuracy",
            subcategory="Tables",
            labels={"result": "recording by recording"},
            caption="../report/recordings.rst",
        ),
        page=f"{RESULTS}/recordings.md",
    log:
        f"{RESULTS}/logs/recording_table.log",
    benchmark:
        f"{RESULTS}/benchmarks/recording_table.tsv"
    params:
        cells=cells(CHOSEN),
        datasets=CHOSEN,
    script:
        "../scripts/recording_table.py"


rule report_cost:
    input:
        table=rules.accuracy_table.output.table,
        verdict=rules.explain.output.verdict,
        twin=rules.explain.output.twin,
        effects=EFFECT_FILES,
        source=scripts_sources("report_cost.py"),
    output:
        report(
            f"{RESULTS}/cost_of_missing_physics.md",
            category="Accuracy",
            subcategory="Tables",
            labels={"result": "cost of missing physics"},
            caption="../report/cost.rst",
        ),
    log:
        f"{RESULTS}/logs/report_cost.log",
    benchmark:
        f"{RESULTS}/benchmarks/report_cost.tsv"
    params:
        pairs=corrected_pairs(),
    script:
        "../scripts/report_cost.py"


# One page of everything: snakemake --cores 2 results/report.html
rule report_page:
    input:
        rig=rig_sheet(),
        recordings=recordings("all"),
        verdict=rules.explain.output.verdict,
        twin=rules.explain.output.twin,
        explained=rules.explain.output.figures,
        diagnosis=rules.diagnose.output if DIAGNOSED_HERE else [],
        table=rules.accuracy_table.output.table if SCORED_HERE else [],
        paper=PAPER,
        answers=rules.ask_networks.output.answers if ASKED_HERE else [],
        attention=shown_attention(),
        source=scripts_sources("report_page.py"),
    output:
        report(
            f"{RESULTS}/report.html",
            category="Summary",
            subcategory="Page",
            labels={"result": "everything on one page"},
            caption="../report/page.rst",
        ),
    log:
        f"{RESULTS}/logs/report_page.log",
    benchmark:
        f"{RESULTS}/benchmarks/report_page.tsv"
    params:
        rig=rig_content(*RIG_SECTIONS, recordings="all"),
        recordings=WHOSE_RECORDINGS,
        benchmarks=f"{RESULTS}/benchmarks",
        population=scored_population(),
        datasets={name: DATASETS[name]._asdict() for name in CHOSEN},
        configuration=config,
    script:
        "../scripts/report_page.py"
