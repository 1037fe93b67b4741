# Recorded pressure -> flow at the pump outlet, by the calibrated line.
rule flow_sensor:
    input:
        recorded=rules.ingest.output,
        twin=rules.calibrate.output.twin,
        source=library("flow_sensor.py"),
    output:
        directory(f"{RESULTS}/recordings/flow.zarr"),
    params:
        bandwidth_hz=config["flow_sensor"]["bandwidth_hz"],
    log:
        f"{RESULTS}/logs/flow_sensor.log",
    benchmark:
        f"{RESULTS}/benchmarks/flow_sensor.tsv"
    conda:
        ENVIRONMENT
    threads: 1
    resources:
        mem_mb=1000,
    script:
        "../scripts/flow_sensor.py"
