"""Similarity of the synthetic hands that the sign model is trained on to those of people, judged by a classifier.

Run ``python benchmarks/hands.py``. The photos are not part of the repository (docs/signs.md); those of the report part
are used. An area under the ROC curve of 0.5 means that synthetic and real hands cannot be distinguished, 1.0 that they
always can. Hands of one shape are compared, by the features that the sign model gets; the classifier is trained on half
of them and evaluated on the other half.
"""

import argparse
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from handsteer.plugins.teach.network import train
from handsteer.plugins.teach.synthetic.fit import seen_hands
from handsteer.plugins.teach.synthetic.hands import OTHER, SHAPES, make_hands
from handsteer.plugins.teach.synthetic.people import draw_people, from_canonical, load_people
from handsteer.recognition.features import shape_features

DATA = Path(__file__).parents[2] / "shared" / "data"
FOLDERS = ("hagrid-dev", "photos")
Array = NDArray[np.float64]


def main() -> None:
    parser = argparse.ArgumentParser(description="Compare synthetic hands with those of people.")
    parser.add_argument(
        "--data", type=Path, default=DATA, help="folder that contains the folders hagrid-dev and photos"
    )
    folders = [folder for name in FOLDERS if (folder := parser.parse_args().data / name).is_dir()]
    if not folders:
        raise SystemExit(f"none of the folders {', '.join(FOLDERS)} exists; set their parent folder with --data")
    real: dict[str, list[Array]] = {}
    for folder in folders:
        for kind, coordinates in seen_hands(folder, "report"):
            real.setdefault(kind if kind in SHAPES else OTHER, []).append(coordinates)
    random = np.random.default_rng(0)
    hands = make_hands(60_000, random)
    image, space, shapes = draw_people(30_000, random, load_people())
    made = {"kinematic": (shape_features(hands.pixels, hands.world), hands.shapes)}
    made["of people's statistics"] = (shape_features(image, space), shapes)
    print(f"{'area under the ROC curve':26}" + "".join(f"{name:>26}" for name in made) + f"{'photos':>10}")
    for shape, rows in sorted(real.items()):
        features = shape_features(*from_canonical(np.array(rows)))
        areas = [separability(features, theirs[named == SHAPES.index(shape)]) for theirs, named in made.values()]
        print(f"{shape:26}" + "".join(f"{area:26.3f}" for area in areas) + f"{len(rows):10}")


def separability(real: Array, made: Array) -> float:
    """Return the area under the ROC curve of a network trained to distinguish the rows of both."""
    random = np.random.default_rng(1)
    made = made[random.permutation(len(made))[: 4 * len(real)]]
    rows = np.concatenate([real, made])
    is_made = np.repeat([0, 1], [len(real), len(made)])
    half = random.random(len(rows)) < 0.5
    areas = []
    for taught, judged in ((half, ~half), (~half, half)):
        network = train(rows[taught], is_made[taught], hidden=(8,), epochs=40, seed=0)
        chances = network.probabilities(rows[judged])[:, 1]
        areas.append(area_under_roc(chances[is_made[judged] == 0], chances[is_made[judged] == 1]))
    return float(np.mean(areas))


def area_under_roc(lower: Array, higher: Array) -> float:
    """Return the share of pairs in which ``higher`` is above ``lower``, 0 to 1 (Mann-Whitney U)."""
    above = higher[:, None] > lower[None, :]
    return float(above.mean() + 0.5 * (higher[:, None] == lower[None, :]).mean())


if __name__ == "__main__":
    main()
