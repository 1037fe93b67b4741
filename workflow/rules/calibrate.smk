# Healthy recordings -> the calibrated twin, its report and its pictures.
rule calibrate:
    input:
        rig=RIG,
        recordings=recordings(),
        source=library("calibrate.py"),
    output:
        twin=f"{RESULTS}/calibration/twin.json",
        report=f"{RESULTS}/calibration/report.md",
        ripples=directory(f"{RESULTS}/calibration/ripples.zarr"),
    log:
        f"{RESULTS}/logs/calibrate.log",
    benchmark:
        f"{RESULTS}/benchmarks/calibrate.tsv"
    threads: 1
    resources:
        mem_mb=2000,
    params:
        method=config["calibration"]["method"],
        friction=config["calibration"]["friction"],
        max_frequency_hz=config["calibration"]["max_frequency_hz"],
    script:
        "../scripts/calibrate.py"


rule plot_calibration:
    input:
        ripples=rules.calibrate.output.ripples,
        source=library("plot_calibration.py"),
    output:
        report(
            directory(f"{RESULTS}/figures/calibration"),
            patterns=["{label}.png"],
            category="calibration",
            caption="../report/calibration.rst",
        ),
    log:
        f"{RESULTS}/logs/plot_calibration.log",
    benchmark:
        f"{RESULTS}/benchmarks/plot_calibration.tsv"
    threads: 1
    resources:
        mem_mb=1000,
    script:
        "../scripts/plot_calibration.py"
