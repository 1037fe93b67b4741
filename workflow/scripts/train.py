"""One network trained on every seed's samples, or on early windows of each state's recording."""

import json
from collections import Counter
from dataclasses import asdict

import numpy as np

from job import open_log
from rippletwin import store
from rippletwin.learning.architectures import CLASSES
from rippletwin.learning.arithmetic import choose_arithmetic
from rippletwin.learning.networks import build, save_tensors
from rippletwin.learning.side_by_side import train_all
from rippletwin.learning.training import TrainingSettings, train_stepwise
from rippletwin.learning.windows import check_window_counts, early_known, learnt_from

report_progress = open_log(snakemake)
params, paths = snakemake.params, snakemake.input.samples
settings = TrainingSettings(**params.settings, threads=snakemake.threads)
arithmetic = choose_arithmetic(params.gpu, params.precision)


def samples(path):
    """x and y of a store; a recorded cylinder fault has the severity that scoring gives it."""
    data = store.load(path)
    if "label" in data:
        return data.signal.values, data.label.values
    state, recording = data.state.values, data.recording.values
    learnt = Counter(recording[learnt_from(state, recording)].tolist())
    counts = {data.labels[k]: n for k, n in learnt.items()}
    check_window_counts(counts, params.learnt_share, settings.validation_fraction)
    kept = early_known(state, recording, params.learnt_share)
    scored = np.where(state == "C", params.cylinder, state)[kept]
    return data.signal.values[kept], np.array([CLASSES.index(s) for s in scored])


def report_epoch(epoch, so_far):
    print(f"epoch {epoch}: {so_far.validation_loss[-1]:.4f}")


def train_seed(seed):
    """The training of one seed, not yet begun."""
    x, y = samples(paths[min(seed, len(paths) - 1)])
    network = build(snakemake.wildcards.architecture, channels=x.shape[1])
    return train_stepwise(network, x, y, settings, seed, report_epoch, arithmetic)


weights, histories = [], []
for network, history in train_all(map(train_seed, range(params.seeds)), arithmetic.device):
    weights.append(network.state_dict())
    histories.append(asdict(history))
    report_progress(
        f"seed {len(weights)} of {params.seeds}: {history.epochs} epochs in {arithmetic}, "
        f"{history.reason}, validation accuracy {history.best_accuracy:.1%}"
    )
save_tensors(weights, snakemake.output.weights)
store.write_text(snakemake.output.history, json.dumps(histories, indent=1))
