"""``handsteer signs train``: learn signs from what was collected."""

import json as json_format
import sys
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from tqdm import tqdm

from handsteer.cli.app import Flag
from handsteer.cli.running import say
from handsteer.cli.signs.tables import teaching_tables
from handsteer.config import SignsConfig, TeachConfig
from handsteer.errors import TrainingError
from handsteer.recognition.custom_signs import save_custom_model
from handsteer.recognition.recognizer import open_classifier
from handsteer.training.custom.dataset import Dataset, load_dataset
from handsteer.training.custom.train import train_signs

_LOW_RECALL = 0.8
_DEFAULTS = TeachConfig()


def train(
    *datasets: Path,
    output: Path = _DEFAULTS.model,
    sided: Annotated[list[str] | None, Parameter(consume_multiple=True)] = None,
    json: Flag = False,
) -> int:
    """Learn the signs of datasets, and print how well they are told from each other and from all other hands.

    Example: handsteer signs train signs.npz --output my-signs.npz

    The shipped signs are known already, and stay as they are; what a dataset has of them, and of NONE, is taken as
    examples of other hands. Drive with what was learnt by --signs.model my-signs.npz, and say what a sign does by
    --control.actions.Hi stop.

    Parameters
    ----------
    datasets
        Files that `signs collect` and `signs import` have written; by default signs.npz.
    output
        File to write what was learnt to.
    sided
        Signs that are not to be told when they are mirrored, as the other hand would show them; those that point to a
        side never are.
    json
        Print one JSON object.
    """
    if not output.absolute().parent.is_dir():
        raise TrainingError(f"--output: there is no folder {output.absolute().parent} for {output.name}")
    takes = [take for path in datasets or (_DEFAULTS.dataset,) for take in load_dataset(path).takes]
    with tqdm(unit=" steps", file=sys.stderr, disable=not sys.stderr.isatty()) as bar:

        def progress(done: int, of: int) -> None:
            bar.total = of
            bar.update(done - bar.n)

        shipped = open_classifier(SignsConfig())
        model, report = train_signs(Dataset(tuple(takes)), shipped, sided=tuple(sided or ()), progress=progress)
    save_custom_model(model, output)
    print(json_format.dumps({"model": str(output), **report.as_dict()}) if json else teaching_tables(report))
    for sign in report.signs:
        if sign.recall is not None and (sign.recall.rate or 0) < _LOW_RECALL:
            say(f"{sign.summary.label} is told badly: collect further takes, in all the ways in which it shall count")
    say(f"what was learnt is in {output}: drive with --signs.model {output}")
    return 0
