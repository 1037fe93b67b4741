# Windows of two revolutions, simulated or recorded -> synchrosqueezed images.
# Recordings are scaled as the simulation that learns from them, or as themselves.
rule image:
    input:
        samples=[f"{RESULTS}/samples/{{dataset}}/{{windows}}x2.zarr"],
        reference=reference_of,
        source=library("image.py"),
    output:
        temp(directory(f"{RESULTS}/images/{{dataset}}/{{windows}}.zarr")),
    log:
        f"{RESULTS}/logs/image/{{dataset}}/{{windows}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/image/{{dataset}}/{{windows}}.tsv"
    threads: 1
    resources:
        mem_mb=4000,
    params:
        size=config["sst"]["size"],
        min_frequency_hz=config["sst"]["min_frequency_hz"],
        max_frequency_hz=config["sst"]["max_frequency_hz"],
        voices=config["sst"]["voices"],
        k=config["sst"]["k"],
    script:
        "../scripts/image.py"


use rule image as image_seeds with:
    input:
        samples=every_seed("samples/{dataset}/{seed}x2.zarr"),
        reference=reference_of,
        source=library("image.py"),
    output:
        temp(directory(every_seed("images/{dataset}/{seed}.zarr"))),
    log:
        f"{RESULTS}/logs/image/{{dataset}}/seeds.log",
    benchmark:
        f"{RESULTS}/benchmarks/image/{{dataset}}/seeds.tsv"
