"""The page of a whole run: accuracies beside the paper's, attention, timings, configuration."""

import json

import pandas as pd
from PIL import Image

from diagnosed_rigs import made_rows
from made_results import write_results
from run_script import run_script


def test_the_page_has_what_only_a_workflow_knows(tmp_path):
    """Mean and deviation over two seeds by hand, the paper's beside; seconds summed over jobs; the
    picture inside the page; of a trial of ten rigs, how many blocked ports were called what."""
    case = tmp_path / "made"
    case.mkdir()
    write_results(case)
    rows = pd.DataFrame(
        {"architecture": "cnn1d_341_100", "dataset": "CFD-P", "seed": [0, 1], "accuracy": [60, 70]}
    )
    rows.to_csv(tmp_path / "accuracy.csv", index=False)
    theirs = {"architecture": ["cnn1d_341_100"], "dataset": "CFD-P", "mean": 37.6, "std": 25.6}
    pd.DataFrame({"domain": "time"} | theirs).to_csv(tmp_path / "paper.csv", index=False)
    benchmarks = tmp_path / "benchmarks" / "train"
    benchmarks.mkdir(parents=True)
    for name, seconds in (("one", "20.5"), ("two", "10.5")):
        (benchmarks / f"{name}.tsv").write_text(f"s\tmax_rss\n{seconds}\t300.0\n")
    (benchmarks / "short.tsv").write_text("s\tmax_rss\n0.01\t-\n")
    (tmp_path / "rows.json").write_text(json.dumps(made_rows()))
    Image.new("RGB", (4, 4)).save(tmp_path / "attention_time_simulated.png")
    said = {"run 7": {"cnn1d_3_1": {"state": "cylinder", "share": 0.875, "unlike": 0.0625}}}
    (tmp_path / "networks.json").write_text(json.dumps(said))
    run_script(
        "report_page",
        tmp_path,
        output={"page": str(tmp_path / "report.html")},
        wildcards={},
        params={
            "recordings": "the virtual rig's",
            "benchmarks": str(tmp_path / "benchmarks"),
            "population": [str(tmp_path / "rows.json"), "digest"],
            "datasets": {
                "CFD-P": {
                    "line": "pipe",
                    "signal": "pressure",
                    "twin": "none",
                    "randomised": "no",
                    "anchored": "no",
                }
            },
            "configuration": {"seeds": 2, "case": "<virtualrig>"},
        },
        rig=str(case / "rig.yaml"),
        verdict=str(case / "explained" / "verdict.json"),
        diagnosis=[str(case / "diagnosed" / "diagnosis.json")],
        table=str(tmp_path / "accuracy.csv"),
        answers=str(tmp_path / "networks.json"),
        paper=str(tmp_path / "paper.csv"),
        attention=[str(tmp_path / "attention_time_simulated.png")],
    )
    page = (tmp_path / "report.html").read_text()
    for words in (
        "run 7</td>",
        "88</td>",
        "65.0 ± 7.1",
        "37.6 ± 25.6",
        "31.0</td>",
        "data:image/png;base64,",
        "case: &lt;virtualrig&gt;",
        "Missing physics found and named",
        "60 recordings of 10 virtual rigs",
        "pressure of the pump alone, on a pipe (CFD-P)",
        "S: worn slipper.",
        "blocked port: cylinder 5, unlike 5",
    ):
        assert words in page, words
