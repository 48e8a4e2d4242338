import threading

import numpy as np
import pytest

from handsteer.errors import TrainingError
from handsteer.plugins.teach.background import BackgroundTraining
from handsteer.plugins.teach.dataset import Dataset
from tests.plugins.teach.takes import shaken, takes

PEACE = Dataset(tuple(takes("Peace", count=2)))


@pytest.mark.slow
def test_a_process_of_its_own_learns_the_same_and_tells_how_far_it_is() -> None:
    steps: list[tuple[int, int]] = []
    result = BackgroundTraining(PEACE).run(lambda done, of: steps.append((done, of)))
    assert result is not None
    model, report = result
    assert (model.labels, report.held_out, report.signs[0].summary.takes) == (("Peace",), "take", 2)
    assert steps == [(step, steps[-1][1]) for step in range(1, steps[-1][1] + 1)]
    hand = shaken("Peace", np.random.default_rng(9))
    pixels, world = hand.pixels.astype(np.float64), hand.world.astype(np.float64)
    assert model.confidences(pixels[None, :, :2], world[None])[0, 0] > 0.8


def test_what_cannot_be_learnt_is_told() -> None:
    with pytest.raises(TrainingError, match="too little data for Peace: 1 take"):
        BackgroundTraining(Dataset(PEACE.takes[:1])).run()


@pytest.mark.slow
def test_a_training_that_is_cancelled_comes_to_nothing() -> None:
    training = BackgroundTraining(PEACE)
    begun = threading.Event()
    results: list[object] = []
    thread = threading.Thread(target=lambda: results.append(training.run(lambda *_: begun.set())))
    thread.start()
    assert begun.wait(60)
    training.cancel()
    thread.join(10)
    assert results == [None]
    assert training.run() is None, "one that was cancelled does not begin"
