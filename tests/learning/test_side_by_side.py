"""Trainings that take turns give what each gives alone; a GPU's graph steps as its kernels do."""

from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pytest
import torch

from rippletwin.learning.arithmetic import FLOAT32, Arithmetic
from rippletwin.learning.networks import build
from rippletwin.learning.side_by_side import take_turns, train_all
from rippletwin.learning.training import TrainingSettings, predict, train, train_stepwise
from rippletwin.learning.training_steps import TrainingSteps

SETTINGS = TrainingSettings(batch_size=8, learning_rate=3e-3, max_epochs=4, target_loss=0.1)
needs_gpu = pytest.mark.skipif(not torch.cuda.is_available(), reason="torch finds no GPU")


def tones(count, seed):
    """Windows (count, 1, 3072) of one tone of four, in noise, and which."""
    rng = np.random.default_rng(seed)
    y = np.arange(count) % 4
    angle = 2 * np.pi * np.arange(3072) / 3072
    phase = rng.uniform(0, 2 * np.pi, (count, 1))
    x = np.sin((y[:, None] + 1) * angle + phase) + 0.1 * rng.standard_normal((count, 3072))
    return x[:, None].astype(np.float32), y


def begin(seed, arithmetic=FLOAT32, network="cnn1d_150_50", settings=SETTINGS):
    x, y = tones(48, seed)
    return train_stepwise(build(network, 1), x, y, settings, seed, arithmetic=arithmetic)


def same_weights(one, other):
    return all(torch.equal(a, b) for a, b in zip(one.parameters(), other.parameters()))


def test_turns_do_not_mix_trainings():
    """Networks that take turns have the weights of networks trained alone, bit for bit, in order,
    though one ends epochs before the others."""
    short = replace(SETTINGS, max_epochs=1)
    settings = [SETTINGS, short, SETTINGS]
    alone = [train(build("cnn1d_150_50", 1), *tones(48, s), settings[s], s) for s in range(3)]
    turns = take_turns((begin(s, settings=settings[s]) for s in range(3)), nullcontext)
    assert [history.epochs for _, history in turns] == [h.epochs for _, h in alone] == [4, 1, 4]
    for (network, history), (reference, expected) in zip(turns, alone):
        assert same_weights(network, reference)
        assert history == expected


def test_a_processor_holds_the_samples_of_one_training():
    """The second training is asked for only when the first has ended."""
    asked = []

    def trainings():
        for seed in range(2):
            asked.append(seed)
            yield begin(seed)

    first = next(train_all(trainings(), torch.device("cpu")))
    assert asked == [0] and first[1].epochs >= 1


@needs_gpu
@pytest.mark.parametrize("network", ["cnn1d_150_50", "resnet18_1d"])
def test_a_recorded_step_is_the_step(network, monkeypatch):
    """Replays of the graph change weights, statistics and loss as the same steps started kernel by
    kernel do; recording leaves no trace."""
    arithmetic = Arithmetic(torch.device("cuda"), torch.float32)
    monkeypatch.setattr(torch.backends.cudnn, "deterministic", True)
    x, y = (torch.as_tensor(a, device="cuda") for a in tones(48, 0))
    results = []
    for replayed in (True, False):
        torch.manual_seed(0)
        model = build(network, 1).to("cuda").train()
        steps = TrainingSteps(model, x, y, 1e-3, 16, arithmetic)
        for batch in torch.arange(48, device="cuda").split(16):
            (steps.take if replayed else steps._step)(batch)
        results.append((model.state_dict(), steps.pop_loss()))
    (one, loss), (other, expected) = results
    assert loss == pytest.approx(expected, rel=1e-5) and loss > 1
    for key in one:
        torch.testing.assert_close(one[key], other[key], rtol=1e-4, atol=1e-5)


@needs_gpu
def test_the_rate_of_a_recorded_step_falls():
    """A scheduler's rate reaches the graph: at rate zero nothing moves."""
    arithmetic = Arithmetic(torch.device("cuda"), torch.float32)
    x, y = (torch.as_tensor(a, device="cuda") for a in tones(16, 0))
    model = build("cnn1d_150_50", 1).to("cuda").train()
    steps = TrainingSteps(model, x, y, 1e-3, 16, arithmetic)
    fall = torch.optim.lr_scheduler.CosineAnnealingLR(steps.optimiser, 1)
    fall.step()
    before = model.head.weight.clone()
    steps.take(torch.arange(16, device="cuda"))
    assert torch.equal(before, model.head.weight)


@needs_gpu
def test_turns_on_a_gpu_learn():
    """Trainings in streams of their own, in mixed precision, tell held-out windows apart, though
    one of them, and its graph, end epochs before the others."""
    arithmetic = Arithmetic(torch.device("cuda"), torch.bfloat16)
    settings = [replace(SETTINGS, max_epochs=epochs) for epochs in (1, 15, 15, 15)]
    trainings = (begin(seed, arithmetic, settings=settings[seed]) for seed in range(4))
    x, y = tones(40, 9)
    (_, short), *others = train_all(trainings, arithmetic.device)
    assert short.epochs == 1
    for network, history in others:
        assert history.arithmetic == "bfloat16 on cuda"
        assert (predict(network, x)[0] == y).mean() > 0.9
