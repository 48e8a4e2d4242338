"""Trains the shipped sign model: ``python -m handsteer.signs.training [FILE]``."""

import sys
from pathlib import Path

from tqdm import tqdm

from handsteer.signs.model import DEFAULT_MODEL, save_model
from handsteer.signs.training.default import EPOCHS, train_default


def main() -> None:
    """Train, and write the file given on the command line, or else the one in the package."""
    path = Path(sys.argv[1]) if len(sys.argv) > 1 else DEFAULT_MODEL
    with tqdm(total=EPOCHS, unit="epoch", disable=None) as bar:
        model = train_default(lambda _: bar.update(1))
    save_model(model, path)


if __name__ == "__main__":
    main()
