# Recordings -> windows of one revolution at the diagnosed operating point, with the sensors' noise.
if RECORDED_HERE:
    POINTS = config["virtualrig"]["points"]

    rule record:
        input:
            # a user's own file, unless it is a name
            points=local([] if POINTS in ("full", "smoke") else [POINTS]),
            source=relative(package_files("virtualrig")),
        output:
            rig=RIG,
            recordings=directory(f"{CASE}/recordings"),
        log:
            f"{RESULTS}/logs/record.log",
        benchmark:
            f"{RESULTS}/benchmarks/record.tsv"
        threads: 2
        resources:
            mem_mb=2000,
        params:
            case=subpath(output.rig, parent=True),
            points=POINTS,
            seed=config["virtualrig"]["seed"],
        shell:
            "virtualrig record --out {params.case:q} --points {params.points:q} --seed {params.seed:q}"
            " --processes {threads} > {log:q} 2>&1"


rule cut_windows:
    input:
        rig=rig_sheet(),
        recordings=recordings("reference"),
        source=scripts_sources("cut_windows.py"),
    output:
        windows=directory(f"{RESULTS}/recordings/pressure.zarr"),
    log:
        f"{RESULTS}/logs/cut_windows.log",
    benchmark:
        f"{RESULTS}/benchmarks/cut_windows.tsv"
    resources:
        mem_mb=2000,
    params:
        rig=rig_content("pump", "sensors", recordings="reference"),
        windows=config["windows"]["per_recording"],
        samples=config["windows"]["samples_per_revolution"],
    script:
        "../scripts/cut_windows.py"
