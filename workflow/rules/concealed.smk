# How often `explain` is right when the effect is hidden: snakemake --cores 2 concealed
from tool_commit import not_committed, tool_commit

CONCEALED = f"{RESULTS}/concealed"
TOOL = ROOT / "src/concealed/tool.py"
HIDDEN = [f"{n:03d}" for n in range(config["concealed"]["cases"])]


wildcard_constraints:
    hidden="[0-9]{3}",


rule concealed_numerics:
    input:
        source=relative(package_files("virtualrig")),
    output:
        f"{CONCEALED}/numerics.json",
    log:
        f"{RESULTS}/logs/concealed_numerics.log",
    benchmark:
        f"{RESULTS}/benchmarks/concealed_numerics.tsv"
    params:
        commit=lambda wildcards: tool_commit(ROOT),
        number=config["concealed"]["number"],
        cases=config["concealed"]["cases"],
    shell:
        "virtualrig check --commit {params.commit:q} --number {params.number:q}"
        " --cases {params.cases:q} --out {output:q} > {log:q} 2>&1"


rule conceal:
    input:
        numerics=rules.concealed_numerics.output,
        source=relative(package_files("virtualrig")),
    output:
        case=directory(f"{CONCEALED}/cases/{{hidden}}"),
        seal=f"{CONCEALED}/seals/{{hidden}}.json",
        key=f"{CONCEALED}/keys/{{hidden}}",
    log:
        f"{RESULTS}/logs/conceal/{{hidden}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/conceal/{{hidden}}.tsv"
    params:
        commit=lambda wildcards: tool_commit(ROOT),
        number=config["concealed"]["number"],
        cases=config["concealed"]["cases"],
        case=lambda wildcards: int(wildcards.hidden),
        bench=config["concealed"]["bench"],
    shell:
        "virtualrig conceal --commit {params.commit:q} --number {params.number:q}"
        " --bench {params.bench:q} --cases {params.cases:q} --case {params.case:q} --out {output.case:q}"
        " --seal {output.seal:q} --key {output.key:q} > {log:q} 2>&1"


# The tool may open its own source, the case and where it writes: neither seals nor keys.
rule explain_concealed:
    input:
        case=rules.conceal.output.case,
        tool=relative([TOOL, TOOL.with_name("jail.py")]),
        source=relative(source_files_of(TOOL)),
    output:
        verdict=f"{CONCEALED}/explained/{{hidden}}/verdict.json",
        baselines=f"{CONCEALED}/explained/{{hidden}}/baselines.json",
    log:
        f"{RESULTS}/logs/explain_concealed/{{hidden}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/explain_concealed/{{hidden}}.tsv"
    resources:
        mem_mb=2000,
    params:
        out=subpath(output.verdict, parent=True),
        cache=f"{CONCEALED}/cache",
    shell:
        "(mkdir -p {params.out:q} {params.cache:q};"
        ' NUMBA_CACHE_DIR="$(realpath {params.cache:q})" TMPDIR={params.out:q}'
        " python -m concealed.jail --read {input.case:q} --write {params.out:q} --write {params.cache:q}"
        " -- python -m concealed.tool {input.case:q} {params.out:q}) > {log:q} 2>&1"


rule commit_verdicts:
    input:
        seals=expand_outputs(rules.conceal.output.seal, hidden=HIDDEN),
        results=expand_outputs(rules.explain_concealed.output, hidden=HIDDEN),
        source=scripts_sources("commit_results.py"),
    output:
        f"{CONCEALED}/commitments.json",
    log:
        f"{RESULTS}/logs/commit_verdicts.log",
    benchmark:
        f"{RESULTS}/benchmarks/commit_verdicts.tsv"
    script:
        "../scripts/commit_results.py"


rule oracle_concealed:
    input:
        commitments=rules.commit_verdicts.output,
        case=rules.conceal.output.case,
        seal=rules.conceal.output.seal,
        key=rules.conceal.output.key,
        source=scripts_sources("oracle_concealed.py"),
    output:
        f"{CONCEALED}/oracle/{{hidden}}.json",
    log:
        f"{RESULTS}/logs/oracle_concealed/{{hidden}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/oracle_concealed/{{hidden}}.tsv"
    resources:
        mem_mb=2000,
    script:
        "../scripts/oracle_concealed.py"


rule score_concealed:
    input:
        commitments=rules.commit_verdicts.output,
        oracles=expand_outputs(rules.oracle_concealed.output, hidden=HIDDEN),
        seals=expand_outputs(rules.conceal.output.seal, hidden=HIDDEN),
        seal_keys=expand_outputs(rules.conceal.output.key, hidden=HIDDEN),
        verdicts=expand_outputs(rules.explain_concealed.output.verdict, hidden=HIDDEN),
        baselines=expand_outputs(
            rules.explain_concealed.output.baselines, hidden=HIDDEN
        ),
        source=scripts_sources("score_concealed.py"),
    output:
        rows=f"{CONCEALED}/rows.json",
    log:
        f"{RESULTS}/logs/score_concealed.log",
    benchmark:
        f"{RESULTS}/benchmarks/score_concealed.tsv"
    script:
        "../scripts/score_concealed.py"


rule report_concealed:
    input:
        rows=rules.score_concealed.output.rows,
        numerics=rules.concealed_numerics.output,
        source=scripts_sources("report_concealed.py"),
    output:
        page=report(
            f"{CONCEALED}/report.md",
            category="Concealed trial",
            subcategory="Tables",
            labels={"result": "scores"},
            caption="../report/concealed.rst",
        ),
        figures=report(
            directory(f"{CONCEALED}/figures"),
            patterns=["{name}.png"],
            category="Concealed trial",
            subcategory="Figures",
            labels=lambda wildcards: {"result": in_words(wildcards.name)},
            caption="../report/concealed.rst",
        ),
    log:
        f"{RESULTS}/logs/report_concealed.log",
    benchmark:
        f"{RESULTS}/benchmarks/report_concealed.tsv"
    params:
        commit=lambda wildcards: tool_commit(ROOT),
        not_committed=lambda wildcards: not_committed(ROOT),
        number=config["concealed"]["number"],
    script:
        "../scripts/report_concealed.py"


rule concealed:
    input:
        rules.report_concealed.output,
