# Recorded pressure -> source flow of the pump, by the line of the calibrated or corrected twin.
rule flow_sensor:
    input:
        recorded=rules.cut_windows.output.windows,
        twin=twin_of,
        effects=EFFECT_FILES,
        source=scripts_sources("flow_sensor.py"),
    output:
        directory(f"{RESULTS}/recordings/flow_{{twin}}.zarr"),
    log:
        f"{RESULTS}/logs/flow_sensor/{{twin}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/flow_sensor/{{twin}}.tsv"
    params:
        bandwidth_hz=config["flow_sensor"]["bandwidth_hz"],
        method=config["flow_sensor"]["method"],
        width=pinn_setting("width"),
        steps=pinn_setting("steps"),
    script:
        "../scripts/flow_sensor.py"
