"""Training to a stated convergence rule, and prediction.

A training stops when the loss on its validation split (a random part of the samples it is given)
has either stayed below ``target_loss`` for ``patience`` epochs in a row ("target"), or not fallen
by ``min_improvement`` (relative) for ``plateau`` epochs ("plateau"), or after ``max_epochs``. It
has **converged** in the first case, and in the second if its lowest loss is below half of that of
guessing. The weights of the epoch with the lowest validation loss are kept.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Callable, Generator
from dataclasses import dataclass, field

import numpy as np
import torch
from torch import nn

from rippletwin.learning.arithmetic import FLOAT32, Arithmetic
from rippletwin.learning.networks import BATCH, Classifier
from rippletwin.learning.training_steps import TrainingSteps


@dataclass(frozen=True)
class TrainingSettings:
    """How a network learns, and the numbers of the rule above."""

    batch_size: int = 32
    learning_rate: float = 1e-3
    falling_rate: bool = False  # to zero at max_epochs, as half a cosine (Loshchilov, Hutter 2017)
    validation_fraction: float = 0.2
    target_loss: float = 0.02  # nats a sample
    patience: int = 2  # epochs in a row below target_loss
    plateau: int = 10  # epochs without improvement
    min_improvement: float = 0.01  # relative
    max_epochs: int = 100
    threads: int = 1


@dataclass
class History:
    """Per epoch: validation loss and accuracy; how it ended, and what it computed with."""

    validation_loss: list[float] = field(default_factory=list)
    validation_accuracy: list[float] = field(default_factory=list)
    best_epoch: int = 0
    converged: bool = False
    reason: str = "max_epochs"  # or "target" or "plateau"
    arithmetic: str = ""

    @property
    def epochs(self) -> int:
        return len(self.validation_loss)

    @property
    def best_loss(self) -> float:
        """Validation loss of the best epoch, nats a sample."""
        return self.validation_loss[self.best_epoch]

    @property
    def best_accuracy(self) -> float:
        """Validation accuracy of the best epoch, 0 to 1."""
        return self.validation_accuracy[self.best_epoch]


Training = Generator[None, None, tuple[Classifier, History]]
"""A training under way: it yields after every step, and returns the network with its history."""


def train(
    network: Classifier,
    x: np.ndarray,
    y: np.ndarray,
    settings: TrainingSettings,
    seed: int,
    progress: Callable[[int, History], None] | None = None,
    arithmetic: Arithmetic = FLOAT32,
) -> tuple[Classifier, History]:
    """Adam on the cross entropy of (x, y) until the rule above stops it; deterministic in ``seed``.

    x : (n, channels, M) or (n, channels, size, size); y : (n,) class indices.
    The network's weights are drawn anew from ``seed``; ``network.scale`` becomes the root mean
    square of the training part of x about silence. progress(epoch, history) is called after every
    epoch. The returned network is on the processor. Sets torch's thread count to
    ``settings.threads``. Raises ValueError where a class has no sample in one of the two parts.
    """
    return finish(train_stepwise(network, x, y, settings, seed, progress, arithmetic))


def finish(training: Training) -> tuple[Classifier, History]:
    """Take all steps of a training that are left."""
    while True:
        try:
            next(training)
        except StopIteration as end:
            return end.value


def train_stepwise(
    network: Classifier,
    x: np.ndarray,
    y: np.ndarray,
    settings: TrainingSettings,
    seed: int,
    progress: Callable[[int, History], None] | None = None,
    arithmetic: Arithmetic = FLOAT32,
) -> Training:
    """As ``train``, but halting after every step, so that several trainings can take turns."""
    torch.set_num_threads(settings.threads)
    rng = np.random.default_rng(seed)
    fit, validation = stratified_split(y, settings.validation_fraction, rng)
    device = arithmetic.device
    images = torch.as_tensor(x, dtype=torch.float32, device=device)
    labels = torch.as_tensor(y, device=device)
    del x  # on a GPU, its memory serves the next training
    initialise(network, seed)
    network.to(device)
    ripple = images[fit] - network.architecture.silence
    network.scale.fill_(float(ripple.square().mean().sqrt()) or 1.0)
    del ripple
    steps = TrainingSteps(
        network, images, labels, settings.learning_rate, settings.batch_size, arithmetic
    )
    del images
    fall = torch.optim.lr_scheduler.CosineAnnealingLR(steps.optimiser, settings.max_epochs)
    history, best = History(arithmetic=str(arithmetic)), None

    for epoch in range(settings.max_epochs):
        network.train()
        order = torch.as_tensor(rng.permutation(fit), device=device)
        for batch in order.split(settings.batch_size):
            if len(batch) < 2:  # batch normalisation needs two
                continue
            steps.take(batch)
            yield
        if settings.falling_rate:
            fall.step()
        loss, accuracy = _validate(steps, validation)
        history.validation_loss.append(loss)
        history.validation_accuracy.append(accuracy)
        if best is None or loss < history.best_loss:
            history.best_epoch, best = epoch, copy.deepcopy(network.state_dict())
        if progress:
            progress(epoch, history)
        reason = stopping_reason(history.validation_loss, settings)
        if reason:
            guessing = math.log(len(np.unique(y)))  # numpy's scalars do not go into JSON
            history.converged = reason == "target" or history.best_loss < guessing / 2
            history.reason = reason
            break

    network.load_state_dict(best)
    return network.to("cpu").eval(), history


def stopping_reason(validation_loss: list[float], settings: TrainingSettings) -> str | None:
    """ "target", "plateau", or None while the rule at the top of this module says go on."""
    recent = validation_loss[-settings.patience :]
    if len(recent) == settings.patience and max(recent) < settings.target_loss:
        return "target"
    if len(validation_loss) > settings.plateau:
        before, after = validation_loss[: -settings.plateau], validation_loss[-settings.plateau :]
        if min(after) > (1 - settings.min_improvement) * min(before):
            return "plateau"
    return None


def stratified_split(
    y: np.ndarray, fraction: float, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Indices to fit (most) and to hold out (``fraction`` of every class)."""
    fit, validation = [], []
    for label in np.unique(y):
        index = rng.permutation(np.flatnonzero(y == label))
        cut = round(fraction * len(index))
        if not 0 < cut < len(index):
            raise ValueError(f"class {label} has {len(index)} samples: too few to split")
        validation.append(index[:cut])
        fit.append(index[cut:])
    return np.concatenate(fit), np.concatenate(validation)


def initialise(network: nn.Module, seed: int) -> None:
    """Draw every parameter anew by its layer's own rule, leaving torch's global generator alone."""
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        for layer in network.modules():
            if (reset := getattr(layer, "reset_parameters", None)) is not None:
                reset()


@torch.no_grad()
def predict(
    network: Classifier, x: np.ndarray, batch_size: int = BATCH
) -> tuple[np.ndarray, np.ndarray]:
    """Class indices (n,) and probabilities (n, classes) of x, in its own unit."""
    log_probabilities = predict_log_probabilities(network, x, batch_size)
    return log_probabilities.argmax(axis=1), np.exp(log_probabilities)


@torch.no_grad()
def predict_log_probabilities(
    network: Classifier, x: np.ndarray, batch_size: int = BATCH
) -> np.ndarray:
    """Logarithms (n, classes) of the probabilities of x, in its own unit: they tell apart what is
    so sure that the probability is 0 or 1."""
    network.eval()
    logits = _in_batches(network, torch.as_tensor(x, dtype=torch.float32), batch_size).cpu()
    return logits.double().log_softmax(1).numpy()


@torch.no_grad()
def activation_statistics(network: Classifier, x: np.ndarray) -> np.ndarray:
    """``Classifier.activation_statistics`` (n, D) of x."""
    network.eval()
    inputs = torch.as_tensor(x, dtype=torch.float32)
    return _in_batches(network.activation_statistics, inputs).cpu().numpy()


@torch.no_grad()
def _validate(steps: TrainingSteps, held_out: np.ndarray) -> tuple[float, float]:
    """Mean loss, nats a sample, and accuracy, 0 to 1, of the samples of these indices (n,)."""
    network, labels = steps.network.eval(), steps.labels[held_out]
    with steps.arithmetic.mixed():
        logits = _in_batches(network.answer, steps.images[held_out]).float()
    accuracy = (logits.argmax(1) == labels).double().mean()
    return float(nn.functional.cross_entropy(logits, labels)), float(accuracy)


def _in_batches(
    answer: Callable[[torch.Tensor], torch.Tensor], x: torch.Tensor, batch_size: int = BATCH
) -> torch.Tensor:
    return torch.cat([answer(batch) for batch in x.split(batch_size)])
