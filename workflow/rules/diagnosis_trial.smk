# How often `diagnose` is right on a population of rigs: snakemake --cores 2 diagnosis_trial
from tool_commit import not_committed, tool_commit

TRIAL = f"{RESULTS}/diagnosis_trial"
DIAGNOSER = ROOT / "src/diagnosis_trial/tool.py"
DRAWN = [f"{n:03d}" for n in range(config["diagnosis_trial"]["rigs"])]


wildcard_constraints:
    drawn="[0-9]{3}",


rule record_population:
    input:
        source=relative(package_files("virtualrig")),
    output:
        case=directory(f"{TRIAL}/cases/{{drawn}}"),
        seal=f"{TRIAL}/seals/{{drawn}}.json",
        key=f"{TRIAL}/keys/{{drawn}}",
    log:
        f"{RESULTS}/logs/record_population/{{drawn}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/record_population/{{drawn}}.tsv"
    params:
        commit=lambda wildcards: tool_commit(ROOT),
        number=config["diagnosis_trial"]["number"],
        rig=lambda wildcards: int(wildcards.drawn),
    shell:
        "virtualrig population --commit {params.commit:q} --number {params.number:q}"
        " --rig {params.rig:q} --out {output.case:q} --seal {output.seal:q} --key {output.key:q}"
        " > {log:q} 2>&1"


# The tool may open its own source, the case and where it writes: neither seals nor keys.
rule diagnose_population:
    input:
        case=rules.record_population.output.case,
        tool=relative([DIAGNOSER, ROOT / "src/concealed/jail.py"]),
        source=relative(source_files_of(DIAGNOSER)),
    output:
        diagnosis=f"{TRIAL}/diagnosed/{{drawn}}/diagnosis.json",
        run=f"{TRIAL}/diagnosed/{{drawn}}/run.json",
    log:
        f"{RESULTS}/logs/diagnose_population/{{drawn}}.log",
    benchmark:
        f"{RESULTS}/benchmarks/diagnose_population/{{drawn}}.tsv"
    resources:
        mem_mb=3000,
    params:
        out=subpath(output.diagnosis, parent=True),
        cache=f"{TRIAL}/cache",
        columns=config["diagnosis_trial"]["methods"],
    shell:
        "(mkdir -p {params.out:q} {params.cache:q};"
        ' NUMBA_CACHE_DIR="$(realpath {params.cache:q})" TMPDIR={params.out:q}'
        ' python -m concealed.jail --read {input.case:q} --read "$(dirname {input.tool[0]:q})"'
        " --write {params.out:q} --write {params.cache:q}"
        " -- python -m diagnosis_trial.tool {input.case:q} {params.out:q} {params.columns:q}) > {log:q} 2>&1"


rule commit_diagnoses:
    input:
        seals=expand_outputs(rules.record_population.output.seal, drawn=DRAWN),
        results=expand_outputs(rules.diagnose_population.output, drawn=DRAWN),
        source=scripts_sources("commit_results.py"),
    output:
        f"{TRIAL}/commitments.json",
    log:
        f"{RESULTS}/logs/commit_diagnoses.log",
    benchmark:
        f"{RESULTS}/benchmarks/commit_diagnoses.tsv"
    script:
        "../scripts/commit_results.py"


rule score_diagnosis_trial:
    input:
        commitments=rules.commit_diagnoses.output,
        seals=expand_outputs(rules.record_population.output.seal, drawn=DRAWN),
        seal_keys=expand_outputs(rules.record_population.output.key, drawn=DRAWN),
        diagnoses=expand_outputs(
            rules.diagnose_population.output.diagnosis, drawn=DRAWN
        ),
        runs=expand_outputs(rules.diagnose_population.output.run, drawn=DRAWN),
        source=scripts_sources("score_diagnosis_trial.py"),
    output:
        rows=f"{TRIAL}/rows.json",
    log:
        f"{RESULTS}/logs/score_diagnosis_trial.log",
    benchmark:
        f"{RESULTS}/benchmarks/score_diagnosis_trial.tsv"
    script:
        "../scripts/score_diagnosis_trial.py"


rule report_diagnosis_trial:
    input:
        rows=rules.score_diagnosis_trial.output.rows,
        source=scripts_sources("report_diagnosis_trial.py"),
    output:
        page=report(
            f"{TRIAL}/report.md",
            category="Diagnosis trial",
            subcategory="Tables",
            labels={"result": "scores"},
            caption="../report/diagnosis_trial.rst",
        ),
        figures=report(
            directory(f"{TRIAL}/figures"),
            patterns=["{name}.png"],
            category="Diagnosis trial",
            subcategory="Figures",
            labels=lambda wildcards: {"result": in_words(wildcards.name)},
            caption="../report/diagnosis_trial.rst",
        ),
    log:
        f"{RESULTS}/logs/report_diagnosis_trial.log",
    benchmark:
        f"{RESULTS}/benchmarks/report_diagnosis_trial.tsv"
    params:
        commit=lambda wildcards: tool_commit(ROOT),
        not_committed=lambda wildcards: not_committed(ROOT),
        number=config["diagnosis_trial"]["number"],
    script:
        "../scripts/report_diagnosis_trial.py"


rule diagnosis_trial:
    input:
        rules.report_diagnosis_trial.output,
