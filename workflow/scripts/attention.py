"""What trained networks look at: alignment of every seed, heat of the first seed's network."""

import numpy as np
import torch
import xarray as xr

from job import open_log
from rippletwin import store
from rippletwin.learning.architectures import CLASSES
from rippletwin.learning.arithmetic import choose_device
from rippletwin.learning.attention_summary import fault_attention, recording_attention
from rippletwin.learning.grad_cam import attention_density, attention_map, fault_region
from rippletwin.learning.networks import restore_networks
from rippletwin.learning.windows import spread_windows

WINDOWS = 16  # of the first recording of each state, for the mean heat

report_progress = open_log(snakemake)
torch.set_num_threads(snakemake.threads)
probes, recorded = store.load(snakemake.input.probes), store.load(snakemake.input.recorded)
x = {name: probes.signal.values[probes.state.values == name] for name in CLASSES}
faults, first_turn = CLASSES[1:], np.stack([x[name][0] for name in CLASSES])
regions = np.array([fault_region(x["H"], x[fault]) for fault in faults])
spread = spread_windows(recorded.state.values, recorded.recording.values, WINDOWS)
windows = [recorded.signal.values[at] for at in spread.values()]
trained = torch.load(snakemake.input.weights, weights_only=True)
network = snakemake.wildcards.architecture, first_turn.shape[1]
first, *others = restore_networks(*network, trained, choose_device(snakemake.params.gpu))
shares = [fault_attention(net, x, dict(zip(faults, regions))) for net in (first, *others)]
attended, blind = (np.array(share) for share in zip(*shares))
heat = attention_density(attention_map(first, first_turn, np.arange(len(CLASSES))))
called, called_share, recorded_heat = zip(*(recording_attention(first, part) for part in windows))

axes, sizes = probes.signal.dims[2:], regions.mean(axis=(1, 2))  # (time,) or (frequency, column)
store.save(
    xr.Dataset(
        {
            "attended": (("seed", "fault"), attended),
            "blind": (("seed", "fault"), blind),
            "region": ("fault", sizes),
            "fault_region": (("state", axes[0]), np.pad(regions[:, 0], ((1, 0), (0, 0)))),
            "simulated": (("state", "channel", *axes), first_turn, probes.signal.attrs),
            "simulated_heat": (("state", *axes), heat),
            "recorded": (("recording", "channel", *axes), [part[0] for part in windows]),
            "recorded_heat": (("recording", *axes), np.array(recorded_heat)),
            "called_share": ("recording", list(called_share)),
        },
        coords={
            "state": list(CLASSES),
            "fault": list(faults),
            "recording": list(spread),
            "called": ("recording", list(called)),
            "channel": probes.channel.values,
        },
        attrs={"speed_hz": probes.speed_hz},
    ),
    snakemake.output[0],
)
report_progress(f"attention in the faults' regions over chance: {np.nanmean(attended / sizes):.2f}")
