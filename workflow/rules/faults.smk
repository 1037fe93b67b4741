# The pump, healthy and faulty -> outlet flow, and pressure in a pipe nobody calibrated.
rule fault:
    input:
        rig=rig_sheet(),
        recordings=rules.ingest.output.windows,
        source=library("fault.py"),
    output:
        directory(f"{RESULTS}/faults/{{state}}.zarr"),
    log:
        f"{RESULTS}/logs/fault/{{state}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/fault/{{state}}.tsv"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        rig=rig_sections("fluid", "pump", "line", "sensors"),
        leak_area=leak_area_of,
        pipe_length=config["faults"]["pipe_length"],
    script:
        "../scripts/fault.py"
