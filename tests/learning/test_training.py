"""Training learns what can be learned, stops when it says, and repeats itself."""

from __future__ import annotations

import json
from dataclasses import asdict

import numpy as np
import pytest
import torch

from rippletwin.learning.dataset import augment
from rippletwin.learning.networks import build
from rippletwin.learning.training import (
    TrainingSettings,
    initialise,
    predict,
    stopping_reason,
    stratified_split,
    train,
)

QUICK = TrainingSettings(batch_size=16, learning_rate=3e-3, max_epochs=12, target_loss=0.05)


def ripples(samples_per_class, rng_seed, noise=0.02):
    """Nine pulses a revolution; the classes weaken none, one, or two of them."""
    angle = np.arange(3072) * 2 * np.pi / 3072
    weights = np.ones((4, 9))
    weights[1, 0], weights[2, [0, 4]], weights[3, [0, 4]] = 0.4, 0.7, (0.0, 0.3)
    pulses = np.array([np.exp(8 * (np.cos(angle - 2 * np.pi * i / 9) - 1)) for i in range(9)])
    seed = 1e5 * (weights @ pulses)[:, None]
    return augment(seed, samples_per_class, [noise * 1e5], np.random.default_rng(rng_seed))


def test_a_learnable_problem_is_learned():
    """Held-out windows of the same simulation, drawn with another generator, are classified."""
    x, y = ripples(40, 0)
    network, history = train(build("cnn1d_341_100", 1), x, y, QUICK, seed=0)
    x_new, y_new = ripples(25, 1)
    labels, probabilities = predict(network, x_new)
    assert (labels == y_new).mean() > 0.95
    np.testing.assert_allclose(probabilities.sum(1), 1, rtol=1e-5)
    assert history.validation_loss[history.best_epoch] < history.validation_loss[0]


def test_shuffled_labels_teach_nothing():
    """The control: with labels drawn at random the same network stays at chance on true labels."""
    x, y = ripples(60, 0)
    shuffled = np.random.default_rng(0).permutation(y)
    settings = TrainingSettings(batch_size=16, learning_rate=3e-3, max_epochs=4)
    _, history = train(build("cnn1d_341_100", 1), x, shuffled, settings, seed=0)
    assert max(history.validation_accuracy) < 0.5  # chance 0.25, 48 samples
    assert min(history.validation_loss) > 1.2  # chance: log 4 = 1.386


def test_images_train_too():
    """A 2D network learns which quarter of an image is bright, validation included."""
    rng = np.random.default_rng(0)
    y = np.repeat(np.arange(4), 24)
    x = np.ones((96, 2, 16, 16), dtype=np.float32)
    for image, label in zip(x, y):
        image[:, 4 * label : 4 * label + 4] += rng.uniform(0.5, 1.5, (2, 4, 16))
    order = rng.permutation(96)
    settings = TrainingSettings(batch_size=8, learning_rate=1e-2, max_epochs=12)
    network, _ = train(build("cnn2d_3_1", 2), x[order[:64]], y[order[:64]], settings, seed=0)
    assert (predict(network, x[order[64:]])[0] == y[order[64:]]).mean() > 0.9


def test_same_seed_same_weights_and_another_seed_others():
    """Bit for bit, whatever state torch's global generator is in; that state is left alone."""
    x, y = ripples(5, 0)
    settings = TrainingSettings(batch_size=8, max_epochs=1)

    def weights(seed):
        return train(build("resnet18_1d", 1), x, y, settings, seed)[0].state_dict()

    torch.manual_seed(5)
    a = weights(1)
    state = torch.random.get_rng_state()
    torch.manual_seed(99)
    b, c = weights(1), weights(2)
    assert all(torch.equal(a[key], b[key]) for key in a)
    assert not all(torch.equal(a[key], c[key]) for key in a)
    torch.manual_seed(5)
    build("resnet18_1d", 1)
    assert torch.equal(torch.random.get_rng_state(), state)


def test_training_converges_by_target_and_says_so():
    """An easy problem ends before max_epochs, its last losses below the target."""
    x, y = ripples(25, 0, noise=0)
    calls = []
    settings = TrainingSettings(batch_size=8, learning_rate=3e-3, max_epochs=40)
    _, history = train(
        build("cnn1d_341_100", 1), x, y, settings, 0, lambda epoch, _: calls.append(epoch)
    )
    assert history.converged and history.reason == "target"
    assert history.epochs < 40 and calls == list(range(history.epochs))
    assert max(history.validation_loss[-settings.patience :]) < settings.target_loss


def test_too_few_epochs_are_not_called_converged():
    """Ending by max_epochs is reported as such."""
    x, y = ripples(10, 0)
    _, history = train(build("cnn1d_341_100", 1), x, y, TrainingSettings(max_epochs=1), 0)
    assert not history.converged and history.reason == "max_epochs" and history.epochs == 1


def test_a_plateau_at_chance_is_not_convergence():
    """A network that learns nothing (silent inputs) stops, is not called converged, and its history
    can be written: one such training must not take a run down."""
    x, y = np.zeros((40, 1, 3072), dtype=np.float32), np.repeat(np.arange(4), 10)
    settings = TrainingSettings(max_epochs=30, plateau=3)
    _, history = train(build("cnn1d_341_100", 1), x, y, settings, 0)
    assert history.reason == "plateau" and not history.converged
    assert json.loads(json.dumps(asdict(history)))["converged"] is False


@pytest.mark.parametrize(
    ("losses", "reason"),
    [
        ([1.0, 0.5, 0.01], None),  # one epoch below target is luck
        ([1.0, 0.01, 0.5, 0.01], None),
        ([1.0, 0.01, 0.01], "target"),
        ([1.0] * 4, None),
        ([1.0] * 5, "plateau"),
        ([1.0, 0.99, 0.98, 0.97, 0.96], None),  # 4 % in four epochs is progress
        ([1.0, 0.5, 0.6, 0.7, 0.6, 0.55], "plateau"),
        ([1.0, 0.5, 0.6, 0.7, 0.6, 0.45], None),
    ],
)
def test_stopping_rule(losses, reason):
    """The rule as the module states it, on sequences decided by hand."""
    settings = TrainingSettings(target_loss=0.02, patience=2, plateau=4, min_improvement=0.01)
    assert stopping_reason(losses, settings) == reason


def test_the_kept_weights_are_those_of_the_best_epoch():
    """The returned network scores the lowest validation loss of the history, not the last."""
    x, y = ripples(15, 0)
    settings = TrainingSettings(batch_size=8, learning_rate=0.1, max_epochs=6)  # rough on purpose
    network, history = train(build("cnn1d_341_100", 1), x, y, settings, seed=3)
    _, held = stratified_split(y, settings.validation_fraction, np.random.default_rng(3))
    _, probabilities = predict(network, x[held])
    loss = -np.log(np.maximum(probabilities[np.arange(len(held)), y[held]], 1e-30)).mean()
    assert loss == pytest.approx(min(history.validation_loss), rel=1e-3)


def test_split_is_stratified_and_disjoint():
    """Every class gives its share; no sample is on both sides."""
    y = np.repeat([0, 1, 3], [10, 20, 30])
    fit, held = stratified_split(y, 0.2, np.random.default_rng(0))
    assert sorted([*fit, *held]) == list(range(60))
    assert [(y[held] == c).sum() for c in (0, 1, 3)] == [2, 4, 6]
    with pytest.raises(ValueError, match="too few"):
        stratified_split(np.array([0, 0, 1]), 0.2, np.random.default_rng(0))


def test_one_scale_for_everything():
    """The unit of the data is free: Pa or MPa give the same predictions (one number is divided
    out), while halving one recording is not undone (no window is normalised)."""
    x, y = ripples(20, 0)
    settings = TrainingSettings(batch_size=8, max_epochs=3)
    pascal, _ = train(build("cnn1d_341_100", 1), x, y, settings, 0)
    mega, _ = train(build("cnn1d_341_100", 1), x / 1e6, y, settings, 0)
    np.testing.assert_allclose(predict(pascal, x)[1], predict(mega, x / 1e6)[1], atol=1e-3)
    assert np.abs(predict(pascal, x / 2)[1] - predict(pascal, x)[1]).max() > 0.01


@pytest.mark.parametrize("falls", [False, True])
def test_the_learning_rate_falls_as_half_a_cosine(monkeypatch, falls):
    """The rates of the steps, against the formula written out: one rate an epoch, the first whole;
    without the setting all are whole."""
    rates = []

    class Watched(torch.optim.Adam):
        def step(self, *arguments):
            rates.append(self.param_groups[0]["lr"])
            return super().step(*arguments)

    monkeypatch.setattr(torch.optim, "Adam", Watched)
    x, y = ripples(10, 0)
    settings = TrainingSettings(
        batch_size=32, learning_rate=1e-3, falling_rate=falls, target_loss=0.0, max_epochs=4
    )
    train(build("cnn1d_341_100", 1), x, y, settings, 0)
    expected = 1e-3 * (1 + np.cos(np.pi * np.arange(4) / 4)) / 2 if falls else np.full(4, 1e-3)
    assert list(dict.fromkeys(np.round(rates, 9))) == list(dict.fromkeys(np.round(expected, 9)))


def test_threads_follow_the_settings():
    """What a scheduler grants is what torch uses."""
    x, y = ripples(5, 0)
    before = torch.get_num_threads()
    for threads in (2, 1):
        settings = TrainingSettings(max_epochs=1, threads=threads)
        train(build("cnn1d_341_100", 1), x, y, settings, 0)
        assert torch.get_num_threads() == threads
    torch.set_num_threads(before)


def test_prediction_is_the_same_in_any_batch():
    """Batch normalisation is frozen: a window's probabilities do not depend on its neighbours."""
    x, _ = ripples(5, 0)
    network = build("resnet18_1d", 1)
    initialise(network, 0)
    together, alone = predict(network, x)[1], predict(network, x, batch_size=1)[1]
    np.testing.assert_allclose(together, alone, atol=1e-4)  # float32, 18 layers
    assert not network.training
