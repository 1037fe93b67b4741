# Twin and recorded healthy ripple -> many revolutions a class, of whatever nobody knows beforehand.
rule randomised_signals:
    input:
        recorded=rules.cut_windows.output.windows,
        twin=lambda wildcards: twin_of(DATASETS[wildcards.dataset]),
        effects=EFFECT_FILES,
        source=scripts_sources("randomised_signals.py"),
    output:
        learnt=directory(f"{RESULTS}/randomised/{{dataset}}/learnt.zarr"),
        held_out=directory(f"{RESULTS}/randomised/{{dataset}}/held_out.zarr"),
    log:
        f"{RESULTS}/logs/randomised_signals/{{dataset}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/randomised_signals/{{dataset}}.tsv"
    resources:
        mem_mb=3000,
    params:
        signal=lambda wildcards: DATASETS[wildcards.dataset].signal,
        anchored=lambda wildcards: DATASETS[wildcards.dataset].anchored == "yes",
        severity=config["faults"]["severity"],
        limit=config["faults"]["severity_limit"],
        draws=config["propagation"]["draws"],
        bandwidth_hz=bandwidth_of,
        learnt_share=config["experimental"]["training_share"],
    script:
        "../scripts/randomised_signals.py"
