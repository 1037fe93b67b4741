# Signals -> samples as the networks take them: seeds shifted and noisy, recordings as they are.
# One job makes all seeds of a dataset: starting Python costs more than a seed does.
rule augment:
    input:
        signals=signals_of,
        recorded=recorded_signal_of,
        source=scripts_sources("augment.py"),
    output:
        temp(
            directory(
                every_seed("samples/{dataset}/{faults}/{seed}x{revolutions}.zarr")
            )
        ),
    log:
        f"{RESULTS}/logs/augment/{{dataset}}/{{faults}}_x{{revolutions}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/augment/{{dataset}}/{{faults}}_x{{revolutions}}.tsv"
    resources:
        mem_mb=2000,
    params:
        samples_per_class=samples_per_class_of,
        noise=config["noise"]["factor"],
    script:
        "../scripts/augment.py"


rule pair_windows:
    input:
        recorded=recorded_signal_of,
        source=scripts_sources("pair_windows.py"),
    output:
        temp(directory(f"{RESULTS}/samples/{{dataset}}/recordedx2.zarr")),
    log:
        f"{RESULTS}/logs/pair_windows/{{dataset}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/pair_windows/{{dataset}}.tsv"
    script:
        "../scripts/pair_windows.py"


rule noise_free_probes:
    input:
        signals=f"{RESULTS}/seeds/{{dataset}}/single.zarr",
        source=scripts_sources("noise_free_probes.py"),
    output:
        directory(f"{RESULTS}/samples/{{dataset}}/probex{{revolutions}}.zarr"),
    log:
        f"{RESULTS}/logs/noise_free_probes/{{dataset}}/{{revolutions}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/noise_free_probes/{{dataset}}/{{revolutions}}.tsv"
    script:
        "../scripts/noise_free_probes.py"
