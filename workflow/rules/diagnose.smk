# What is wrong with the pump, by the corrected twin itself: snakemake --cores 2 diagnose
rule diagnose:
    input:
        rig=rig_sheet(),
        recordings=recordings("all"),
        twin=rules.explain.output.twin,
        verdict=rules.explain.output.verdict,
        effects=EFFECT_FILES,
        faults=local(
            [name for name in config["faults"]["files"] if name.endswith(".py")]
        ),
        source=scripts_sources("diagnose.py"),
    output:
        diagnosis=report(
            f"{RESULTS}/diagnosis/diagnosis.json",
            category="Diagnosis by the twin",
            subcategory="Data",
            labels={"result": "diagnosis of every recording"},
            caption="../report/diagnosis.rst",
        ),
        figures=report(
            directory(f"{RESULTS}/diagnosis/figures"),
            patterns=["{name}.png"],
            category="Diagnosis by the twin",
            subcategory="Figures",
            labels=lambda wildcards: {"result": in_words(wildcards.name)},
            caption="../report/diagnose.rst",
        ),
    log:
        f"{RESULTS}/logs/diagnose.log",
    benchmark:
        f"{RESULTS}/benchmarks/diagnose.tsv"
    resources:
        mem_mb=2000,
    params:
        rig=rig_content(*RIG_SECTIONS, recordings="all"),
        faults=config["faults"]["files"],
    script:
        "../scripts/diagnose.py"
