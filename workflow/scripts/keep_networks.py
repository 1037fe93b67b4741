"""The networks of a randomised dataset with their conformal p-values, kept for `diagnose`.

Each simulated revolution makes one sample. Those learnt give the classes' places, the held-out ones
the p-values. What is promised is compared with the share of recorded windows that is called unlike.
"""

import numpy as np
import pandas as pd
import torch

from job import open_log
from rippletwin import store
from rippletwin.learning.arithmetic import choose_device
from rippletwin.learning.conformal import PROMISED_RATE, fit_conformal
from rippletwin.learning.dataset import each_once, split_by_time
from rippletwin.learning.kept_networks import KeptNetworks
from rippletwin.learning.networks import restore_networks
from rippletwin.learning.training import activation_statistics

report_progress = open_log(snakemake)
torch.set_num_threads(snakemake.threads)
params, name = snakemake.params, snakemake.wildcards.architecture
recorded = store.load(snakemake.input.recorded)
noise = recorded.noise_std.values
(x, y), (held_out, _) = (
    # Signals were drawn from generators of these seeds alone.
    each_once(store.load(path).signal.values, noise, np.random.default_rng([seed, 3]), params.noise)
    for seed, path in enumerate((snakemake.input.learnt, snakemake.input.held_out))
)
weights = torch.load(snakemake.input.weights, weights_only=True)
conformal = []
for network in restore_networks(name, x.shape[1], weights, choose_device(params.gpu)):
    learnt, others = (activation_statistics(network, samples) for samples in (x, held_out))
    conformal.append(fit_conformal(learnt, y, others))
kept = KeptNetworks(
    architecture=name,
    dataset=snakemake.wildcards.dataset,
    signal=params.signal,
    channels=recorded.channel.values.tolist(),
    samples_per_revolution=recorded.sizes["time"],
    speed_hz=recorded.speed_hz,
    load_pressure=recorded.load_pressure,
    weights=weights,
    conformal=conformal,
)
kept.save(snakemake.output.networks)
_, tested = split_by_time(np.bincount(recorded.recording), params.learnt_share)
windows = recorded.isel(window=tested)
_, p_values = kept.answers(windows.signal.values)
told = {"recording": windows.recording.values, "truth": windows.state.values}
rows = pd.DataFrame(told | {"unlike": (p_values <= PROMISED_RATE).mean(axis=0)})
store.write_table(snakemake.output.rates, rows.groupby(list(told)).unlike.mean().reset_index())
report_progress(f"unlike: {rows.unlike[rows.truth == 'H'].mean():.1%} of the healthy windows")
