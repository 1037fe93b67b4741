"""What the networks of every seed say of simulated faults that come together."""

import numpy as np
import pandas as pd
import torch

from job import open_log
from rippletwin import store
from rippletwin.learning.architectures import CLASSES
from rippletwin.learning.arithmetic import choose_device
from rippletwin.learning.networks import restore_networks
from rippletwin.learning.training import predict

report_progress = open_log(snakemake)
torch.set_num_threads(snakemake.threads)
samples = store.load(snakemake.input.samples)
x, faults = samples.signal.values, np.array(samples.label.attrs["classes"])[samples.label.values]

tables = []
trained = torch.load(snakemake.input.weights, weights_only=True)
networks = restore_networks(
    snakemake.wildcards.architecture, x.shape[1], trained, choose_device(snakemake.params.gpu)
)
for seed, network in enumerate(networks):
    predicted, _ = predict(network, x)
    tables.append(
        pd.DataFrame({"seed": seed, "recording": faults, "predicted": np.array(CLASSES)[predicted]})
    )
store.write_table(snakemake.output[0], pd.concat(tables))
report_progress(f"{len(x)} windows, {len(tables)} seeds")
