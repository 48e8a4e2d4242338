"""``handsteer signs list``: the signs and their actions."""

import json as json_format

from handsteer.cli.app import ConfigFile, Flag, Parameters
from handsteer.cli.running import settings
from handsteer.cli.signs.tables import table
from handsteer.control.explain import effect_of
from handsteer.recognition.recognizer import open_classifier
from handsteer.types import NONE, action_of, find_sign


def list_signs(*, json: Flag = False, config_file: ConfigFile = None, parameters: Parameters = None) -> int:
    """Print the signs that the model knows, and what each makes the robot do.

    Example: handsteer signs list --control.actions.Peace turbo

    Parameters
    ----------
    json
        Print one JSON list.
    config_file
        YAML file with parameters; options override it.
    """
    config = settings(config_file, parameters)
    actions = config.control.actions
    known = (*open_classifier(config.signs).signs, NONE)
    named = [sign for sign in actions if find_sign(sign, known) is None]
    signs = [
        {"sign": sign, "action": action, "effect": effect_of(action, config.control), "known": sign in known}
        for sign in (*known, *named)
        for action in [action_of(sign, actions)]
    ]
    if json:
        print(json_format.dumps(signs))
        return 0
    rows = [[str(sign["sign"]), str(sign["action"]), _effect(sign)] for sign in signs]
    print(table(["sign", "action", "the robot"], rows, text_columns=3))
    return 0


def _effect(sign: dict[str, object]) -> str:
    return f"{sign['effect']}{'' if sign['known'] else ' (unknown to the model)'}"
