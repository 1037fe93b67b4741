# Recordings -> windows of one revolution at the diagnosed operating point, with the sensors' noise.
if RECORDED_HERE:

    rule record:
        input:
            source=virtualrig(),
        output:
            rig=RIG,
            recordings=directory(f"{CASE}/recordings"),
        params:
            case=subpath(output.rig, parent=True),
            points=config["virtualrig"]["points"],
            seed=config["virtualrig"]["seed"],
        log:
            f"{RESULTS}/logs/record.log",
        benchmark:
            f"{RESULTS}/benchmarks/record.tsv"
        conda:
            ENVIRONMENT
        threads: 1
        resources:
            mem_mb=2000,
        shell:
            "virtualrig record --out {params.case} --points {params.points} --seed {params.seed}"
            " > {log} 2>&1"


rule ingest:
    input:
        rig=ancient(RIG),
        recordings=recordings(),
        source=library("ingest.py"),
    output:
        directory(f"{RESULTS}/recordings/pressure.zarr"),
    params:
        rig=rig("pump", "sensors", "recordings"),
        windows=config["windows"]["per_recording"],
        samples=config["windows"]["samples_per_revolution"],
    log:
        f"{RESULTS}/logs/ingest.log",
    benchmark:
        f"{RESULTS}/benchmarks/ingest.tsv"
    conda:
        ENVIRONMENT
    threads: 1
    resources:
        mem_mb=2000,
    script:
        "../scripts/ingest.py"
