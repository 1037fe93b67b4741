# The pump, healthy and faulty -> outlet flow, and pressure in a pipe that nobody calibrated.
rule simulate_fault:
    input:
        rig=rig_sheet(),
        recordings=rules.cut_windows.output.windows,
        source=scripts_sources("simulate_fault.py"),
    output:
        directory(f"{RESULTS}/faults/{{state}}.zarr"),
    log:
        f"{RESULTS}/logs/simulate_fault/{{state}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/simulate_fault/{{state}}.tsv"
    params:
        rig=rig_content("fluid", "pump", "line", "sensors", "load"),
        leak_area=leak_area_of,
        pipe_length=config["faults"]["pipe_length"],
    script:
        "../scripts/simulate_fault.py"
