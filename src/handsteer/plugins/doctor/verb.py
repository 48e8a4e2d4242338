"""``handsteer doctor``: what works on this machine."""

import json as json_format
from typing import TYPE_CHECKING

from handsteer.cli.app import Flag, Whole, loads

if TYPE_CHECKING:
    from handsteer.plugins.doctor.examine import Finding


@loads("handsteer.plugins.doctor.examine")
def doctor(*, port: Whole = 8080, json: Flag = False) -> int:
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
    from handsteer.plugins.doctor.examine import examine

    findings = examine(port)
    if json:
        print(json_format.dumps([vars(finding) for finding in findings]))
    else:
        print("\n".join(_text(finding) for finding in findings))
    return 1 if any(finding.verdict == "missing" for finding in findings) else 0


def _text(finding: "Finding") -> str:
    mark = {"ok": "ok", "optional": "--", "wrong": "??", "missing": "!!"}[finding.verdict]
    return f"{mark}  {finding.name:8s} {finding.detail}"
