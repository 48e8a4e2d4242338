"""``handsteer doctor``, ``models`` and ``ros``: the installation on this machine."""

import json as json_format
from pathlib import Path
from typing import TYPE_CHECKING

from handsteer.cli.app import Flag, loads

if TYPE_CHECKING:
    from handsteer.doctor import Finding


@loads("handsteer.doctor")
def doctor(*, port: int = 8080, json: Flag = False) -> int:
    """Check what works on this machine; exit code 1 if something required is missing.

    For example:
      handsteer doctor              what works here, and what to do about the rest
      handsteer doctor --port 9000  for a page on another port
      handsteer doctor --json       for programs

    Parameters
    ----------
    port
        Port of the page.
    json
        Print one JSON list.
    """
    from handsteer.doctor import examine

    findings = examine(port)
    if json:
        print(json_format.dumps([vars(finding) for finding in findings]))
    else:
        print("\n".join(_text(finding) for finding in findings))
    return 1 if any(finding.verdict == "missing" for finding in findings) else 0


def _text(finding: "Finding") -> str:
    mark = {"ok": "ok", "optional": "--", "wrong": "??", "missing": "!!"}[finding.verdict]
    return f"{mark}  {finding.name:8s} {finding.detail}"


@loads("handsteer.cli.models")
def models() -> int:
    """Fetch the landmark models, once, into the user's data directory.

    For example:
      handsteer models

    On a machine without network, set HANDSTEER_MODELS to a folder that contains them.
    """
    from handsteer.cli.models import fetch

    print(f"the landmark models are in {fetch()}")
    return 0


_PACKAGE = Path(__file__).parents[1]


def ros() -> int:
    """Print the folder of the ROS packages: the tutorial's for ROS 1, and handsteer_ros2.

    For example:
      . "$(handsteer ros)/setup.sh"  for roslaunch and ros2 launch
      ls "$(handsteer ros)"          see what is there
    """
    installed = _PACKAGE / "ros"
    print(installed if installed.is_dir() else _PACKAGE.parents[1] / "ros")  # the latter in a checkout
    return 0
