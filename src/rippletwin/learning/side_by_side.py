"""Several trainings on one device: one after another on a processor, in turns on a GPU.

A small network leaves most of a GPU idle. Trainings in turns, each in a stream of its own, fill it;
each gives what it would give alone.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager

import torch

from rippletwin.learning.networks import Classifier
from rippletwin.learning.training import History, Training, finish


def train_all(
    trainings: Iterable[Training], device: torch.device
) -> Iterator[tuple[Classifier, History]]:
    """Networks and histories of trainings (``training.train_stepwise``) on this device, in order.

    On a processor a training is asked for when the one before has ended, so that the samples of one
    are in memory at a time; on a GPU all samples are on it.
    """
    if device.type == "cpu":
        yield from map(finish, trainings)
    else:
        yield from take_turns(trainings, lambda: torch.cuda.stream(torch.cuda.Stream()))


def take_turns(
    trainings: Iterable[Training], open_lane: Callable[[], AbstractContextManager]
) -> list[tuple[Classifier, History]]:
    """Networks and histories of trainings that step in turn, each within a lane of its own.

    open_lane  makes a context in which one training takes its steps; it is entered for each of them
    """
    ended: dict[int, tuple[Classifier, History]] = {}
    running: dict[int, tuple[Training, AbstractContextManager]] = {}

    def step(number: int) -> None:
        training, lane = running[number]
        try:
            with lane:
                next(training)
        except StopIteration as end:
            ended[number] = end.value
            del running[number]

    for number, training in enumerate(trainings):
        running[number] = training, open_lane()
        step(number)
    while running:
        for number in list(running):
            step(number)
    return [ended[number] for number in sorted(ended)]
