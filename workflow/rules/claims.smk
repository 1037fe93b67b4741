# Accuracies and simulated signals -> the paper's claims, and how alike the images are.
rule claims:
    input:
        table=rules.accuracy_table.output.table,
        recordings=rules.recording_table.output.table,
        paper=PAPER,
        rig=rig_sheet(),
        source=scripts_sources("claims.py"),
    output:
        table=report(
            f"{RESULTS}/claims.csv",
            category="Claims of the paper",
            subcategory="Tables",
            labels={"result": "claims"},
            caption="../report/claims.rst",
        ),
        comparisons=report(
            f"{RESULTS}/claims_compared.csv",
            category="Claims of the paper",
            subcategory="Tables",
            labels={"result": "comparisons"},
            caption="../report/claims_compared.rst",
        ),
        page=f"{RESULTS}/claims.md",
        png=report(
            f"{RESULTS}/figures/claims.png",
            category="Claims of the paper",
            subcategory="Figures",
            labels={"result": "claims"},
            caption="../report/claims.rst",
        ),
        svg=f"{RESULTS}/figures/claims.svg",
    log:
        f"{RESULTS}/logs/claims.log",
    benchmark:
        f"{RESULTS}/benchmarks/claims.tsv"
    params:
        rig=rig_content("pump"),
        samples_per_revolution=config["windows"]["samples_per_revolution"],
        datasets=[name for name in CHOSEN if name not in RANDOMISED],
    script:
        "../scripts/claims.py"


rule compare_sst:
    input:
        seeds=expand(f"{RESULTS}/seeds/{{dataset}}/single.zarr", dataset=PRESSURES),
        recorded=rules.cut_windows.output.windows,
        rig=rig_sheet(),
        source=scripts_sources("compare_sst.py"),
    output:
        table=report(
            f"{RESULTS}/similarity.csv",
            category="Simulated signals",
            subcategory="Tables",
            labels={"result": "similarity of the images"},
            caption="../report/similarity.rst",
        ),
        png=report(
            f"{RESULTS}/figures/sst_compared.png",
            category="Simulated signals",
            subcategory="Synchrosqueezed images",
            labels={"result": "recorded and simulated"},
            caption="../report/similarity.rst",
        ),
        svg=f"{RESULTS}/figures/sst_compared.svg",
    log:
        f"{RESULTS}/logs/compare_sst.log",
    benchmark:
        f"{RESULTS}/benchmarks/compare_sst.tsv"
    params:
        titles=[
            "uncalibrated" if DATASETS[name].line == "pipe" else DATASETS[name].twin
            for name in PRESSURES
        ],
        rig=rig_content("pump"),
        sst=config["sst"],
    script:
        "../scripts/compare_sst.py"
