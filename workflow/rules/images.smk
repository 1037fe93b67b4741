# Windows of two revolutions, simulated or recorded -> synchrosqueezed images.
# Recordings are scaled as the simulation that learns from them, or as themselves.
rule synchrosqueeze:
    input:
        samples=[f"{RESULTS}/samples/{{dataset}}/{{windows}}x2.zarr"],
        reference=reference_of,
        source=scripts_sources("synchrosqueeze.py"),
    output:
        temp(directory(f"{RESULTS}/images/{{dataset}}/{{windows}}.zarr")),
    log:
        f"{RESULTS}/logs/synchrosqueeze/{{dataset}}/{{windows}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/synchrosqueeze/{{dataset}}/{{windows}}.tsv"
    resources:
        mem_mb=4000,
    params:
        sst=config["sst"],
    script:
        "../scripts/synchrosqueeze.py"


use rule synchrosqueeze as synchrosqueeze_seeds with:
    input:
        samples=every_seed("samples/{dataset}/{faults}/{seed}x2.zarr"),
        reference=reference_of,
        source=scripts_sources("synchrosqueeze.py"),
    output:
        temp(directory(every_seed("images/{dataset}/{faults}/{seed}.zarr"))),
    log:
        f"{RESULTS}/logs/synchrosqueeze_seeds/{{dataset}}/{{faults}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/synchrosqueeze_seeds/{{dataset}}/{{faults}}.tsv"
