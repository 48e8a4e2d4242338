"""``handsteer signs evaluate``: how well are the signs recognised?"""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from handsteer.cli.app import ConfigFile, Flag, Parameters, loads
from handsteer.cli.running import settings


@loads("handsteer.plugins.teach.verbs.evaluation")
def evaluate(
    *sources: Path,
    json: Flag = False,
    png: Path | None = None,
    reliability: Path | None = None,
    sweep: Flag = False,
    sweep_png: Path | None = None,
    flip: Flag = False,
    rotate: Annotated[str, Parameter(allow_leading_hyphen=True)] = "0",
    as_is: Flag = False,
    grace: float = 0.3,
    config_file: ConfigFile = None,
    parameters: Parameters = None,
) -> int:
    """Print how well the signs are recognised in labelled photos, videos, or datasets of landmarks.

    For example:
      handsteer signs evaluate photos/                         print tables
      handsteer signs evaluate a.mp4 --flip --rotate -15,0,15  also tilted
      handsteer signs evaluate photos/ --png confusion.png     and a plot

    A folder contains an index.csv (columns path, sign, and optionally kind and
    person_set), or a subfolder for each sign and one named negatives.
    The labels of NAME.mp4, if any, are in NAME.labels.csv (columns frame, sign).

    Parameters
    ----------
    sources
        Folders of labelled photos, video files, and datasets (.npz) of `signs collect`.
    json
        Print one JSON object, with the result and the likelihood of each sign for each photo.
    png
        Plot the confusion matrix to this file.
    reliability
        Print the reliability of the likelihoods, and plot it to this file.
    sweep
        Print the results for other confidence thresholds.
    sweep_png
        Plot the results for other confidence thresholds to this file.
    flip
        Flip everything left to right: the other hand, and left for right. With several angles, evaluate each both
        unflipped and flipped.
    rotate
        Rotate everything clockwise by this many degrees; by 180, Forward is Backward. Several (-15,0,15) are compared.
    as_is
        Do not pad and enlarge photos below 400 px.
    grace
        In a video, for how many seconds a sign may still count after it is no longer shown.
    config_file
        YAML file with parameters, each of which is an option too: `handsteer parameters`. Options override the file.
    """
    from handsteer.plugins.teach.verbs.evaluation import print_evaluation, views_of

    config, views = settings(config_file, parameters), views_of(rotate, flip=flip, enlarge=not as_is)
    pictures = {"--png": png, "--reliability": reliability, "--sweep-png": sweep_png}
    print_evaluation(config, sources, views, pictures, grace_s=grace, sweep=sweep, json=json)
    return 0
