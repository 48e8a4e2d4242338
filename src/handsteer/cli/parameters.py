"""``handsteer parameters``: every parameter of the configuration."""

import json as json_format
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from handsteer.cli.app import Flag, loads
from handsteer.errors import ConfigError, did_you_mean

if TYPE_CHECKING:
    from handsteer.parameters import Description


@loads("handsteer.config", "handsteer.parameters")
def parameters(name: str | None = None, /, *, json: Flag = False) -> int:
    """List the parameters: each is an option, such as --control.max-linear 0.5, and a line in a --config file.

    For example:
      handsteer parameters control     those of one section
      handsteer parameters max_linear  those with this in their name
      handsteer parameters --json      all of them, for programs

    Parameters
    ----------
    name
        A section, such as control, or a part of a parameter's name; all by default.
    json
        Print one JSON list.
    """
    rows = list(_rows())
    wanted = (name or "").removeprefix("--").replace("-", "_")
    sections = list(dict.fromkeys(row["section"] for row in rows))
    found = [row for row in rows if row["section"] == wanted if name] or [row for row in rows if wanted in row["name"]]
    if not found:
        near = did_you_mean(wanted, [*sections, *(row["name"].partition(".")[2] for row in rows)])
        raise ConfigError(f"no parameter is called {name}{near or ':'} the sections are {', '.join(sections)}")
    print(json_format.dumps(found) if json else "\n\n".join(map(_text, found)))
    return 0


def _rows() -> Iterator[dict[str, Any]]:
    from handsteer.config import Config
    from handsteer.parameters import describe, plain, section_model

    for section in Config.model_fields:
        model = section_model(section)
        for name, field in model.model_fields.items():
            yield {
                "name": f"{section}.{name}",
                "section": section,
                "option": f"--{section}.{name}".replace("_", "-"),
                "default": plain(field.default),
                "allowed": _allowed(describe(model, name)),
                "meaning": field.description,
                "live": name in model.live,
            }


def _allowed(known: "Description") -> str:
    if known.constraint:
        above = f", at most {known.maximum:g}" if known.maximum is not None and not known.choices else ""
        return f"{known.constraint}{above}"
    if known.minimum is not None and known.maximum is not None:
        return f"{known.minimum:g} to {known.maximum:g}"
    return {"bool": "true or false", "strings": "a list of texts"}.get(known.kind, "a text")


def _text(row: dict[str, Any]) -> str:
    default = "none" if row["default"] is None else json_format.dumps(row["default"], ensure_ascii=False)
    live = "; can change while it runs" if row["live"] else ""
    return f"{row['option']}\n    {row['meaning']}\n    {row['allowed']}; default {default}{live}"
