"""What the networks of every seed say of the recorded windows (of none that they learnt from)."""

import numpy as np
import pandas as pd
import torch

from job import open_log
from rippletwin import store
from rippletwin.learning.architectures import CLASSES
from rippletwin.learning.arithmetic import choose_device
from rippletwin.learning.dataset import split_by_time
from rippletwin.learning.networks import restore_networks
from rippletwin.learning.training import predict

report_progress = open_log(snakemake)
torch.set_num_threads(snakemake.threads)
recorded = store.load(snakemake.input.recorded)
_, kept = split_by_time(np.bincount(recorded.recording), snakemake.params.learnt_share)
x, truth = recorded.signal.values[kept], recorded.state.values[kept]

tables = []
trained = torch.load(snakemake.input.weights, weights_only=True)
networks = restore_networks(
    snakemake.wildcards.architecture, x.shape[1], trained, choose_device(snakemake.params.gpu)
)
for seed, network in enumerate(networks):
    predicted, probability = predict(network, x)
    table = pd.DataFrame(probability, columns=[f"p_{name}" for name in CLASSES]).round(5)
    table.insert(0, "predicted", np.array(CLASSES)[predicted])
    table.insert(0, "truth", truth)
    table.insert(0, "recording", recorded.recording.values[kept])
    table.insert(0, "window", kept)
    table.insert(0, "seed", seed)
    tables.append(table)
store.write_table(snakemake.output[0], pd.concat(tables))
report_progress(f"{len(kept)} windows, {len(tables)} seeds")
