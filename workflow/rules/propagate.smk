# One noise-free revolution a state: the seed signals of each simulated dataset.
rule propagate:
    input:
        flow=f"{RESULTS}/faults/{{state}}.zarr",
        healthy=f"{RESULTS}/faults/H.zarr",
        recordings=rules.ingest.output.windows,
        twin=rules.calibrate.output.twin,
        source=library("propagate.py"),
    output:
        directory(f"{RESULTS}/propagated/{{state}}.zarr"),
    log:
        f"{RESULTS}/logs/propagate/{{state}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/propagate/{{state}}.tsv"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        steps=config["propagation"]["steps_per_revolution"],
        tolerance=config["propagation"]["tolerance"],
    script:
        "../scripts/propagate.py"


rule seed_signal:
    input:
        states=lambda wildcards: expand(
            f"{RESULTS}/{{stage}}/{{state}}.zarr",
            stage="propagated" if wildcards.dataset == "CFD-MOC-P" else "faults",
            state=STATES,
        ),
        source=library("seed_signal.py"),
    output:
        directory(f"{RESULTS}/seeds/{{dataset}}.zarr"),
    log:
        f"{RESULTS}/logs/seed_signal/{{dataset}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/seed_signal/{{dataset}}.tsv"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        signal=lambda wildcards: signal_of(wildcards.dataset),
        bandwidth_hz=config["flow_sensor"]["bandwidth_hz"],
    script:
        "../scripts/seed_signal.py"
