# What physics the calibrated twin still lacks: snakemake --cores 2 explain
rule explain:
    input:
        rig=rig_sheet(),
        recordings=recordings("fit"),
        effects=EFFECT_FILES,
        source=scripts_sources("explain.py"),
    output:
        verdict=report(
            f"{RESULTS}/explain/verdict.json",
            category="Missing physics",
            subcategory="Data",
            labels={"result": "verdict"},
            caption="../report/verdict.rst",
        ),
        twin=f"{RESULTS}/explain/twin.json",
        figures=report(
            directory(f"{RESULTS}/explain/figures"),
            patterns=["{name}.png"],
            category="Missing physics",
            subcategory="Figures",
            labels=lambda wildcards: {"result": in_words(wildcards.name)},
            caption="../report/explain.rst",
        ),
    log:
        f"{RESULTS}/logs/explain.log",
    benchmark:
        f"{RESULTS}/benchmarks/explain.tsv"
    # As soon as there are recordings: later it would wait for both cores to be idle at once.
    priority: 50
    threads: 2
    resources:
        mem_mb=4000,
    params:
        rig=rig_content(*RIG_SECTIONS, recordings="fit"),
    script:
        "../scripts/explain.py"
