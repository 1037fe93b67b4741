# Recorded pressure -> flow at the pump outlet, by the calibrated line.
rule flow_sensor:
    input:
        recorded=rules.ingest.output.windows,
        twin=rules.calibrate.output.twin,
        source=library("flow_sensor.py"),
    output:
        directory(f"{RESULTS}/recordings/flow.zarr"),
    log:
        f"{RESULTS}/logs/flow_sensor.log",
    benchmark:
        f"{RESULTS}/benchmarks/flow_sensor.tsv"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        bandwidth_hz=config["flow_sensor"]["bandwidth_hz"],
    script:
        "../scripts/flow_sensor.py"
