"""Writes docs/configuration.md from the configuration models: each parameter with its default, range and meaning."""

import inspect
import sys
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

from pydantic.fields import FieldInfo

from handsteer.config import Config, Section

PATH = Path(__file__).resolve().parents[1] / "docs" / "configuration.md"
HEAD = """# Configuration

Every parameter has a default, so no file is needed. To change some, write a YAML file with only those:

```yaml
control:
  ramp: per_second
  max_linear: 0.5
camera:
  source: /dev/video2
```

and run `handsteer run --config my.yaml`; without `--config` it reads `handsteer.yaml` of the working directory, if
there is one. Each parameter is also a command line option, such as `--control.max-linear 0.5`, and `handsteer
parameters` lists them; options override the file, and the file overrides the defaults. A node in a ROS graph also
accepts ROS parameters, such as `_max_linear:=0.5` (ROS 1) or `--ros-args -p max_linear:=0.5` (ROS 2); they override
the file, and options override them. Unknown names and values out of range are rejected with exit code 2, before
anything moves.

Parameters marked with * can change while a node runs ([ros2.md](ros2.md#parameters-of-a-running-node)); the others are
read at start-up.

This page is generated from `src/handsteer/config` by `make docs`.
"""


def page() -> str:
    """Return the page's text."""
    sections = [_section(name, field.annotation) for name, field in Config.model_fields.items()]
    return "\n".join([HEAD, *sections])


def _section(name: str, section: Any) -> str:
    assert issubclass(section, Section)
    rows = [_row(name, field, live=name in section.live) for name, field in section.model_fields.items()]
    head = [
        f"## {name}",
        "",
        inspect.cleandoc(section.__doc__ or ""),
        "",
        "| parameter | default | allowed | meaning |",
        "|---|---|---|---|",
    ]
    return "\n".join([*head, *rows, ""])


def _row(name: str, field: FieldInfo, *, live: bool) -> str:
    default = str(field.default).lower() if isinstance(field.default, bool) else field.default
    return f"| `{name}`{' *' if live else ''} | `{default}` | {_allowed(field)} | {field.description} |"


def _allowed(field: FieldInfo) -> str:
    if get_origin(field.annotation) is Literal:
        return ", ".join(f"`{choice}`" for choice in get_args(field.annotation))
    if get_origin(field.annotation) is dict:
        choices = get_args(get_args(field.annotation)[1])
        return "for each name: " + ", ".join(f"`{choice}`" for choice in choices)
    if field.annotation is bool:
        return "`true`, `false`"
    bounds = [
        f"{sign} {getattr(limit, name):g}"
        for limit in field.metadata
        for name, sign in (("gt", ">"), ("ge", "≥"), ("lt", "<"), ("le", "≤"))
        if getattr(limit, name, None) is not None
    ]
    return ", ".join(bounds) or "text"


if __name__ == "__main__":
    if "--check" in sys.argv:
        sys.exit(0 if PATH.read_text(encoding="utf-8") == page() else f"{PATH.name} is not up to date: run make docs")
    PATH.write_text(page(), encoding="utf-8")
