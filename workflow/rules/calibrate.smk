# Healthy recordings -> the calibrated twin, its report and the ripples to draw.
rule calibrate:
    input:
        rig=rig_sheet(),
        recordings=recordings("fit"),
        source=scripts_sources("calibrate.py"),
    output:
        twin=f"{RESULTS}/calibration/twin.json",
        report=report(
            f"{RESULTS}/calibration/report.md",
            category="Calibration",
            subcategory="Tables",
            labels={"result": "parameters and misfits"},
            caption="../report/calibration_table.rst",
        ),
        ripples=directory(f"{RESULTS}/calibration/ripples.zarr"),
    log:
        f"{RESULTS}/logs/calibrate.log",
    benchmark:
        f"{RESULTS}/benchmarks/calibrate.tsv"
    resources:
        mem_mb=2000,
    params:
        rig=rig_content(*RIG_SECTIONS, recordings="fit"),
        method=config["calibration"]["method"],
        friction=config["calibration"]["friction"],
        max_frequency_hz=config["calibration"]["max_frequency_hz"],
    script:
        "../scripts/calibrate.py"
