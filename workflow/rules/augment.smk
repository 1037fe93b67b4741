# Signals -> labelled samples: seeds shifted and noisy (one store a seed), recordings as they are.
# One job makes all seeds of a dataset: starting Python costs more than a seed does.
rule augment:
    input:
        signals=f"{RESULTS}/seeds/{{dataset}}.zarr",
        recorded=recorded_signal_of,
        source=library("augment.py"),
    output:
        temp(directory(every_seed("samples/{dataset}/{seed}x{revolutions}.zarr"))),
    log:
        f"{RESULTS}/logs/augment/{{dataset}}/x{{revolutions}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/augment/{{dataset}}/x{{revolutions}}.tsv"
    threads: 1
    resources:
        mem_mb=2000,
    params:
        samples_per_class=lambda wildcards: config["samples_per_class"][
            "time" if wildcards.revolutions == "1" else "image"
        ],
        noise=config["noise"]["factor"],
    script:
        "../scripts/augment.py"


rule pair:
    input:
        recorded=recorded_signal_of,
        source=library("pair.py"),
    output:
        temp(directory(f"{RESULTS}/samples/{{dataset}}/recordedx2.zarr")),
    log:
        f"{RESULTS}/logs/pair/{{dataset}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/pair/{{dataset}}.tsv"
    threads: 1
    resources:
        mem_mb=1000,
    script:
        "../scripts/pair.py"
