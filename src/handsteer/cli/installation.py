"""``handsteer doctor``, ``models`` and ``ros``: the installation on this machine."""

import json as json_format
from pathlib import Path
from typing import Any

from tqdm import tqdm

from handsteer.cli.app import Flag
from handsteer.doctor import Finding, examine
from handsteer.recognition.landmark_models import fetch_models


def doctor(*, port: int = 8080, json: Flag = False) -> int:
    """Check what works on this machine; exit code 1 if something required is missing.

    Example: handsteer doctor

    Parameters
    ----------
    port
        Port of the page.
    json
        Print one JSON list.
    """
    findings = examine(port)
    if json:
        print(json_format.dumps([vars(finding) for finding in findings]))
    else:
        print("\n".join(_text(finding) for finding in findings))
    return 1 if any(finding.verdict == "missing" for finding in findings) else 0


def _text(finding: Finding) -> str:
    mark = {"ok": "ok", "optional": "--", "wrong": "??", "missing": "!!"}[finding.verdict]
    return f"{mark}  {finding.name:8s} {finding.detail}"


def models() -> int:
    """Fetch the landmark models, once, into the user's data directory.

    Example: handsteer models

    On a machine without network, set HANDSTEER_MODELS to a folder that contains them.
    """
    bar: tqdm[Any] | None = None

    def progress(done: int, total: int) -> None:
        nonlocal bar
        bar = bar or tqdm(total=total, unit="B", unit_scale=True, desc="landmark models")
        bar.update(done - bar.n)

    paths = fetch_models(progress)
    if bar is not None:
        bar.close()
    print(f"the landmark models are in {paths[0].parent}")
    return 0


_PACKAGE = Path(__file__).parents[1]


def ros() -> int:
    """Print the folder of the ROS packages: the tutorial's for ROS 1, and handsteer_ros2.

    Example: . "$(handsteer ros)/setup.sh"
    """
    installed = _PACKAGE / "ros"
    print(installed if installed.is_dir() else _PACKAGE.parents[1] / "ros")  # the latter in a checkout
    return 0
