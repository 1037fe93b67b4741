"""Steps of a training: Adam on the cross entropy of batches, on a GPU as one replayed graph.

A step of a small network is some eighty kernels of a few microseconds each, and starting them from
Python takes longer than they do. A CUDA graph records them once and starts them together.
"""

from __future__ import annotations

import copy

import torch
from torch import nn

from rippletwin.learning.arithmetic import Arithmetic
from rippletwin.learning.networks import BATCH, Classifier

WARM_UP = 3  # steps before a recording, in which libraries choose kernels and take memory


class TrainingSteps:
    """Takes steps of one network on batches of its samples.

    images, labels  all samples, on the device of the network; the attribute ``images`` has them
                    standardised, in the precision of the products
    optimiser       Adam; a scheduler may change its learning rate
    """

    def __init__(
        self,
        network: Classifier,
        images: torch.Tensor,
        labels: torch.Tensor,
        learning_rate: float,
        batch_size: int,
        arithmetic: Arithmetic,
    ):
        self.network, self.arithmetic, self.labels = network, arithmetic, labels
        self.images = _prepare(network, images, arithmetic.precision)
        recorded = arithmetic.device.type == "cuda"
        # a graph reads the rate where it lies; a number would be recorded as it is now
        rate = torch.tensor(learning_rate, device=arithmetic.device) if recorded else learning_rate
        self.optimiser = torch.optim.Adam(
            network.parameters(), lr=rate, fused=True, capturable=recorded
        )
        self.batch = torch.arange(min(batch_size, len(labels)), device=arithmetic.device)
        self.graph = self._record() if recorded else None

    def take(self, batch: torch.Tensor) -> None:
        """One step on the samples of these indices."""
        if self.graph is not None and len(batch) == len(self.batch):
            self.batch.copy_(batch)
            self.graph.replay()
        else:
            self._step(batch)

    def _step(self, batch: torch.Tensor) -> None:
        with self.arithmetic.mixed():
            logits = self.network.answer(self.images[batch])
        loss = nn.functional.cross_entropy(logits.float(), self.labels[batch])
        self.optimiser.zero_grad()
        loss.backward()
        self.optimiser.step()

    def _record(self) -> torch.cuda.CUDAGraph:
        """A graph of one step on ``self.batch``; the network is left as it was."""
        before = copy.deepcopy(self.network.state_dict())
        self.network.train()
        stream = torch.cuda.Stream()
        stream.wait_stream(torch.cuda.current_stream())
        with torch.cuda.stream(stream):
            for _ in range(WARM_UP):
                self._step(self.batch)
        torch.cuda.current_stream().wait_stream(stream)
        graph = torch.cuda.CUDAGraph()
        # Graphs recorded on one stream, torch's default, share the workspace of matrix products.
        with torch.cuda.graph(graph, stream=stream):
            self._step(self.batch)
        self.network.load_state_dict(before)
        for state in self.optimiser.state.values():
            for moment in state.values():
                moment.zero_()
        return graph


def _prepare(network: Classifier, images: torch.Tensor, precision: torch.dtype) -> torch.Tensor:
    """Standardised samples, once for all epochs. Products would round them to ``precision`` too."""
    one = network.standardise(images[:1])
    prepared = torch.empty(
        (len(images), *one.shape[1:]),
        dtype=precision,
        device=one.device,
        memory_format=torch.channels_last,
    )
    for batch, place in zip(images.split(BATCH), prepared.split(BATCH)):
        place.copy_(network.standardise(batch))
    return prepared
