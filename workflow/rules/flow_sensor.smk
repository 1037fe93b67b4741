# Recorded pressure -> flow at the pump outlet, by the calibrated line (flow) or the corrected (flow+).
rule flow_sensor:
    input:
        recorded=rules.ingest.output.windows,
        twin=twin_of,
        source=library("flow_sensor.py"),
    output:
        directory(f"{RESULTS}/recordings/flow{{plus}}.zarr"),
    log:
        f"{RESULTS}/logs/flow_sensor{{plus}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/flow_sensor{{plus}}.tsv"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        bandwidth_hz=config["flow_sensor"]["bandwidth_hz"],
        method=config["flow_sensor"]["method"],
        width=config["flow_sensor"]["pinn"]["width"],
        steps=config["flow_sensor"]["pinn"]["steps"],
    script:
        "../scripts/flow_sensor.py"
