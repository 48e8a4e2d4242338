"""``handsteer doctor``: what works on this machine."""

import json as json_format

from handsteer.cli.options import Flag
from handsteer.doctor import Finding, examine


def doctor(*, port: int = 8080, json: Flag = False) -> int:
    """Say what works on this machine; exit code 1 if something that is needed is missing.

    Example: handsteer doctor

    Parameters
    ----------
    port
        Where the page would be.
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
