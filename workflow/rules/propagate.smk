# One noise-free revolution a state: the seed signals of each simulated dataset.
rule propagate:
    input:
        flow=f"{RESULTS}/faults/{{state}}.zarr",
        healthy=f"{RESULTS}/faults/H.zarr",
        recordings=rules.cut_windows.output.windows,
        twin=twin_of,
        effects=EFFECT_FILES,
        source=scripts_sources("propagate.py"),
    output:
        directory(f"{RESULTS}/propagated/{{twin}}/{{state}}.zarr"),
    log:
        f"{RESULTS}/logs/propagate/{{twin}}/{{state}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/propagate/{{twin}}/{{state}}.tsv"
    params:
        steps=config["propagation"]["steps_per_revolution"],
        tolerance=config["propagation"]["tolerance"],
    script:
        "../scripts/propagate.py"


rule seed_signal:
    input:
        states=states_of,
        source=scripts_sources("seed_signal.py"),
    output:
        directory(f"{RESULTS}/seeds/{{dataset}}/{{faults}}.zarr"),
    log:
        f"{RESULTS}/logs/seed_signal/{{dataset}}/{{faults}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/seed_signal/{{dataset}}/{{faults}}.tsv"
    params:
        signal=seed_variable_of,
        bandwidth_hz=bandwidth_of,
    script:
        "../scripts/seed_signal.py"
