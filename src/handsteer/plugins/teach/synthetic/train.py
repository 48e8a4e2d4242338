"""Trains the shipped sign model on synthetic and drawn hands: ``make signs-model``.

The result is deterministic, so the file in the repository can be verified.
"""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from handsteer.plugins.teach.network import learn_novelty, train
from handsteer.plugins.teach.synthetic.hands import SHAPES, make_hands
from handsteer.plugins.teach.synthetic.people import draw_people, load_people
from handsteer.recognition.features import shape_features
from handsteer.recognition.shipped_signs import DEFAULT_MODEL, FORMAT, SignModel, save_model

SEED: Final = 7
_CHUNKS, _CHUNK, _PEOPLE = 10, 50_000, 20_000
HIDDEN: Final = (96, 48)
EPOCHS: Final = 30


def made_hands(chunks: int, seed: int) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Return (n, features) of n synthetic hands, and their (n,) shapes as indices into ``SHAPES``; deterministic.

    A chunk gives about 56 000 hands.
    """
    people = load_people()
    features, shapes = [], []
    for random in np.random.default_rng(seed).spawn(chunks):
        hands = make_hands(_CHUNK, random)
        image, space, theirs = draw_people(_PEOPLE, random, people)
        # Rounded, to remove differences between processors.
        features += [np.round(shape_features(hands.pixels, hands.world), 4), np.round(shape_features(image, space), 4)]
        shapes += [hands.shapes, theirs]
    return np.concatenate(features), np.concatenate(shapes)


def train_default(progress: Callable[[int], object], chunks: int = _CHUNKS, epochs: int = EPOCHS) -> SignModel:
    """Return a newly trained model.

    Args:
        progress: Called after each epoch with its number, from 1.
        chunks: Amount of training data, as for :func:`made_hands`.
        epochs: Number of passes over it.
    """
    features, shapes = made_hands(chunks, SEED)
    network = train(features, shapes, hidden=HIDDEN, epochs=epochs, seed=SEED, progress=progress)
    novelty = learn_novelty(features, shapes, network.mean, network.scale)
    counts = {shape: int(count) for shape, count in zip(SHAPES, np.bincount(shapes), strict=True)}
    trained_on = {
        "source": "synthetic hands, and hands drawn from statistics of people",
        "seed": SEED,
        "hands": counts,
        "format": FORMAT,
    }
    return SignModel(SHAPES, network, novelty, trained_on)


def main() -> None:
    """Train, and write the file given on the command line, or else the one in the package."""
    path = Path(sys.argv[1]) if len(sys.argv) > 1 else DEFAULT_MODEL
    with tqdm(total=EPOCHS, unit="epoch", disable=None) as bar:
        model = train_default(lambda _: bar.update(1))
    save_model(model, path)


if __name__ == "__main__":
    main()
