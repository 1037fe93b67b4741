# One noise-free revolution a state: the seed signals of each simulated dataset.
# propagated: through the calibrated line; propagated+: through the corrected one.
rule propagate:
    input:
        flow=f"{RESULTS}/faults/{{state}}.zarr",
        healthy=f"{RESULTS}/faults/H.zarr",
        recordings=rules.ingest.output.windows,
        twin=twin_of,
        source=library("propagate.py"),
    output:
        directory(f"{RESULTS}/propagated{{plus}}/{{state}}.zarr"),
    log:
        f"{RESULTS}/logs/propagate{{plus}}/{{state}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/propagate{{plus}}/{{state}}.tsv"
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
        states=states_of,
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
        # What a flow sensor sees is the flow that any line can be driven with.
        signal=lambda wildcards: {"pressure": "pressure", "flow": "source_flow"}[
            signal_of(wildcards.dataset)
        ],
        bandwidth_hz=config["flow_sensor"]["bandwidth_hz"],
    script:
        "../scripts/seed_signal.py"
