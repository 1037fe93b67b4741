"""What a training computes with: chosen by the machine or by hand, and as good in bfloat16."""

from pathlib import Path

import numpy as np
import pytest
import torch

from rippletwin.learning import arithmetic
from rippletwin.learning.arithmetic import FLOAT32, Arithmetic, choose_arithmetic, choose_device
from rippletwin.learning.networks import build
from rippletwin.learning.training import TrainingSettings, predict, train

CPUINFO = Path("/proc/cpuinfo")
BFLOAT16 = Arithmetic(torch.device("cpu"), torch.bfloat16)


@pytest.fixture
def no_gpu(monkeypatch):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)


@pytest.mark.parametrize(
    ("features", "precision"),
    [
        ({"avx512bf16": True}, torch.bfloat16),
        ({"amx-bf16": True}, torch.bfloat16),
        ({"avx512f": True, "avx512bf16": False}, torch.float32),
        ({}, torch.float32),
    ],
)
def test_auto_takes_bfloat16_where_the_processor_multiplies_it(
    no_gpu, monkeypatch, features, precision
):
    """By the names of the instructions alone; a word in the configuration overrules them."""
    monkeypatch.setattr(arithmetic, "get_host_cpu_features", lambda: features)
    assert choose_arithmetic() == Arithmetic(torch.device("cpu"), precision)
    assert choose_arithmetic(precision="float32").precision == torch.float32
    assert choose_arithmetic(precision="bfloat16").precision == torch.bfloat16


@pytest.mark.skipif(not CPUINFO.exists(), reason="the system does not list its instructions")
def test_the_instructions_are_those_that_the_system_lists():
    """Independent truth: the flags of the kernel."""
    flags = set(CPUINFO.read_text().split())
    assert arithmetic.multiplies_bfloat16() == bool({"avx512_bf16", "amx_bf16"} & flags)


def test_a_gpu_is_taken_where_there_is_one(monkeypatch):
    """Found: taken, with bfloat16, unless the configuration says no."""
    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)
    assert choose_device("auto").type == choose_device(True).type == "cuda"
    assert choose_device(False).type == "cpu"
    assert choose_arithmetic().precision == torch.bfloat16


def test_a_gpu_that_is_not_there_is_refused(no_gpu):
    """`auto` goes on without one, `true` ends with what to change; so do unknown words."""
    assert choose_device("auto").type == "cpu"
    with pytest.raises(ValueError, match="auto or false"):
        choose_device(True)
    with pytest.raises(ValueError, match="gpu must be"):
        choose_device("yes")
    with pytest.raises(ValueError, match="precision must be"):
        choose_arithmetic(precision="float16")


def bright_quarters(count, seed):
    """Images (count, 2, 16, 16) with one bright quarter, and which."""
    rng = np.random.default_rng(seed)
    y = np.arange(count) % 4
    x = np.ones((count, 2, 16, 16), dtype=np.float32)
    for image, label in zip(x, y):
        image[:, 4 * label : 4 * label + 4] += rng.uniform(0.5, 1.5, (2, 4, 16))
    return x, y


def test_mixed_precision_learns_as_well_and_keeps_float32_weights():
    """Products are bfloat16 and the weights come out otherwise than in float32, but held-out images
    are told as surely. Weights and answers stay float32."""
    x, y = bright_quarters(64, 0)
    settings = TrainingSettings(batch_size=8, learning_rate=1e-2, max_epochs=20)
    networks, seen = [], set()
    for each in (FLOAT32, BFLOAT16):
        network = build("cnn2d_3_1", 2)
        hook = network.features[3].register_forward_hook(lambda layer, _, out: seen.add(out.dtype))
        network, history = train(network, x, y, settings, 0, arithmetic=each)
        hook.remove()
        assert history.arithmetic == str(each)
        networks.append(network)
    assert seen == {torch.float32, torch.bfloat16}
    assert str(BFLOAT16) == "bfloat16 on cpu"
    new_x, new_y = bright_quarters(40, 1)
    for network in networks:
        assert all(p.dtype == torch.float32 for p in network.parameters())
        labels, _ = predict(network, new_x)
        assert (labels == new_y).mean() > 0.9
        with torch.no_grad():
            assert network(torch.as_tensor(new_x, dtype=torch.float32)).dtype == torch.float32
    weights = [network.features[3].weight for network in networks]
    assert not torch.equal(*weights)


def test_mixed_precision_repeats_itself():
    """The same seed gives the same weights bit for bit in bfloat16 too."""
    x, y = bright_quarters(32, 0)
    settings = TrainingSettings(batch_size=8, max_epochs=1)
    one, other = (
        train(build("cnn2d_3_1", 2), x, y, settings, 3, arithmetic=BFLOAT16)[0].state_dict()
        for _ in range(2)
    )
    assert all(torch.equal(one[key], other[key]) for key in one)
