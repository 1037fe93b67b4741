"""What trained networks look at: alignment of every seed, heat of the first seed's network."""

from collections import Counter

import numpy as np
import torch
import xarray as xr

from job import start
from rippletwin import store
from rippletwin.learning.architectures import CLASSES
from rippletwin.learning.grad_cam import alignment, attention_density, attention_map, fault_region
from rippletwin.learning.networks import restored
from rippletwin.learning.training import predict

WINDOWS = 16  # of each recording, for the mean heat

tell = start(snakemake)
torch.set_num_threads(snakemake.threads)
probes = store.load(snakemake.input.probes)
recorded = store.load(snakemake.input.recorded)
state = probes.state.values
x = {name: probes.signal.values[state == name] for name in CLASSES}
faults = CLASSES[1:]
regions = {fault: fault_region(x["H"], x[fault]) for fault in faults}
first_turn = np.stack([x[name][0] for name in CLASSES])

# evenly over each recording, which may be one of many of its state
recorded_states = list(dict.fromkeys(recorded.state.values.tolist()))
windows = []
for name in recorded_states:
    at = np.flatnonzero(recorded.state.values == name)
    at = at[np.unique(np.linspace(0, len(at) - 1, WINDOWS).round().astype(int))]
    windows.append(recorded.signal.values[at])

attended, blind = [], []
trained, channels = torch.load(snakemake.input.weights), x["H"].shape[1]
for seed, network in enumerate(restored(snakemake.wildcards.architecture, channels, trained)):
    shares = [
        alignment(attention_map(network, x[fault], CLASSES.index(fault)), regions[fault])[0]
        for fault in faults
    ]
    blind.append([np.isnan(share).mean() for share in shares])
    attended.append([np.nan if np.isnan(s).all() else np.nanmean(s) for s in shares])
    if seed == 0:
        heat = attention_density(attention_map(network, first_turn, np.arange(len(CLASSES))))
        called = []
        recorded_heat = []
        for part in windows:
            label, count = Counter(predict(network, part)[0].tolist()).most_common(1)[0]
            called.append((CLASSES[label], count / len(part)))
            looked = attention_density(attention_map(network, part, label))
            seen = ~np.isnan(looked.reshape(len(part), -1)).any(1)
            recorded_heat.append(looked[seen].mean(0) if seen.any() else looked[0])

places = probes.signal.dims[2:]  # (time,) or (frequency, column)
store.save(
    xr.Dataset(
        {
            "attended": (("seed", "fault"), np.array(attended)),
            "blind": (("seed", "fault"), np.array(blind)),
            "region": ("fault", [regions[fault].mean() for fault in faults]),
            "fault_region": (("fault", places[0]), [regions[fault][0] for fault in faults]),
            "simulated": (("state", "channel", *places), first_turn, probes.signal.attrs),
            "simulated_heat": (("state", *places), heat),
            "recorded": (("recording", "channel", *places), [part[0] for part in windows]),
            "recorded_heat": (("recording", *places), recorded_heat),
            "called_share": ("recording", [share for _, share in called]),
        },
        coords={
            "fault": list(faults),
            "state": list(CLASSES),
            "recording": recorded_states,
            "called": ("recording", [name for name, _ in called]),
            "channel": probes.channel.values,
        },
        attrs={"speed_hz": probes.attrs["speed_hz"]},
    ),
    snakemake.output[0],
)
gain = np.nanmean(np.array(attended) / [regions[fault].mean() for fault in faults])
tell(f"attention seeks the fault {gain:.2f} times as often as chance")
