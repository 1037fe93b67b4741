# Pictures: calibration, simulated signals, accuracies, attention.
rule plot_calibration:
    input:
        ripples=rules.calibrate.output.ripples,
        source=scripts_sources("plot_calibration.py"),
    output:
        report(
            directory(f"{RESULTS}/figures/calibration"),
            patterns=["{label}.png"],
            category="Calibration",
            subcategory="Ripples",
            labels={"recording": "{label}"},
            caption="../report/calibration.rst",
        ),
    log:
        f"{RESULTS}/logs/plot_calibration.log",
    benchmark:
        f"{RESULTS}/benchmarks/plot_calibration.tsv"
    script:
        "../scripts/plot_calibration.py"


rule plot_seeds:
    input:
        rig=rig_sheet(),
        seeds=f"{RESULTS}/seeds/{{dataset}}/single.zarr",
        reference=reference_of,
        source=scripts_sources("plot_seeds.py"),
    output:
        ripple=report(
            f"{RESULTS}/figures/seeds_{{dataset}}.png",
            category="Simulated signals",
            subcategory="Ripples",
            labels={"dataset": "{dataset}"},
            caption="../report/seeds.rst",
        ),
        ripple_svg=f"{RESULTS}/figures/seeds_{{dataset}}.svg",
        sst=report(
            f"{RESULTS}/figures/sst_{{dataset}}.png",
            category="Simulated signals",
            subcategory="Synchrosqueezed images",
            labels={"dataset": "{dataset}"},
            caption="../report/sst.rst",
        ),
        sst_svg=f"{RESULTS}/figures/sst_{{dataset}}.svg",
    log:
        f"{RESULTS}/logs/plot_seeds/{{dataset}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/plot_seeds/{{dataset}}.tsv"
    params:
        rig=rig_content("pump"),
        # the picture has a size of its own
        sst={key: value for key, value in config["sst"].items() if key != "size"},
    script:
        "../scripts/plot_seeds.py"


use rule plot_seeds as plot_compound_seeds with:
    input:
        rig=rig_sheet(),
        seeds=f"{RESULTS}/seeds/{{dataset}}/compound.zarr",
        reference=reference_of,
        source=scripts_sources("plot_seeds.py"),
    output:
        ripple=report(
            f"{RESULTS}/figures/seeds_compound/{{dataset}}.png",
            category="Compound faults",
            subcategory="Ripples",
            labels={"dataset": "{dataset}"},
            caption="../report/seeds.rst",
        ),
        ripple_svg=f"{RESULTS}/figures/seeds_compound/{{dataset}}.svg",
        sst=report(
            f"{RESULTS}/figures/sst_compound/{{dataset}}.png",
            category="Compound faults",
            subcategory="Synchrosqueezed images",
            labels={"dataset": "{dataset}"},
            caption="../report/sst.rst",
        ),
        sst_svg=f"{RESULTS}/figures/sst_compound/{{dataset}}.svg",
    log:
        f"{RESULTS}/logs/plot_compound_seeds/{{dataset}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/plot_compound_seeds/{{dataset}}.tsv"


rule plot_accuracy:
    input:
        table=rules.accuracy_table.output.table,
        paper=PAPER,
        source=scripts_sources("plot_accuracy.py"),
    output:
        png=report(
            f"{RESULTS}/figures/accuracy.png",
            category="Accuracy",
            subcategory="Figures",
            labels={"result": "accuracy beside the paper's"},
            caption="../report/accuracy.rst",
        ),
        svg=f"{RESULTS}/figures/accuracy.svg",
    log:
        f"{RESULTS}/logs/plot_accuracy.log",
    benchmark:
        f"{RESULTS}/benchmarks/plot_accuracy.tsv"
    script:
        "../scripts/plot_accuracy.py"


rule plot_confusion:
    input:
        table=rules.accuracy_table.output.table,
        source=scripts_sources("plot_confusion.py"),
    output:
        png=report(
            f"{RESULTS}/figures/confusion_{{dataset}}.png",
            category="Accuracy",
            subcategory="Confusion matrices",
            labels={"dataset": "{dataset}"},
            caption="../report/confusion.rst",
        ),
        svg=f"{RESULTS}/figures/confusion_{{dataset}}.svg",
    log:
        f"{RESULTS}/logs/plot_confusion/{{dataset}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/plot_confusion/{{dataset}}.tsv"
    script:
        "../scripts/plot_confusion.py"


rule plot_ranks:
    input:
        table=rules.attention_table.output.table,
        source=scripts_sources("plot_ranks.py"),
    output:
        png=report(
            f"{RESULTS}/figures/attention_ranks.png",
            category="Attention",
            subcategory="Figures",
            labels={"result": "ranks of the networks"},
            caption="../report/attention_ranks.rst",
        ),
        svg=f"{RESULTS}/figures/attention_ranks.svg",
    log:
        f"{RESULTS}/logs/plot_ranks.log",
    benchmark:
        f"{RESULTS}/benchmarks/plot_ranks.tsv"
    script:
        "../scripts/plot_ranks.py"


rule plot_attention:
    input:
        attention=lambda wildcards: expand_outputs(
            rules.attention.output,
            dataset=wildcards.dataset,
            architecture=of_domain(wildcards.domain),
        ),
        rig=rig_sheet(),
        source=scripts_sources("plot_attention.py"),
    output:
        simulated=report(
            f"{RESULTS}/figures/attention_{{dataset}}_{{domain}}_simulated.png",
            category="Attention",
            subcategory="Maps",
            labels={
                "dataset": "{dataset}",
                "domain": "{domain}",
                "signals": "simulated",
            },
            caption="../report/attention_simulated.rst",
        ),
        simulated_svg=f"{RESULTS}/figures/attention_{{dataset}}_{{domain}}_simulated.svg",
        recorded=report(
            f"{RESULTS}/figures/attention_{{dataset}}_{{domain}}_recorded.png",
            category="Attention",
            subcategory="Maps",
            labels={
                "dataset": "{dataset}",
                "domain": "{domain}",
                "signals": "recorded",
            },
            caption="../report/attention_recorded.rst",
        ),
        recorded_svg=f"{RESULTS}/figures/attention_{{dataset}}_{{domain}}_recorded.svg",
    log:
        f"{RESULTS}/logs/plot_attention/{{dataset}}_{{domain}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/plot_attention/{{dataset}}_{{domain}}.tsv"
    params:
        architectures=lambda wildcards: of_domain(wildcards.domain),
        rig=rig_content("pump"),
        sst=config["sst"],
    script:
        "../scripts/plot_attention.py"
