"""Parameters as a graph's own parameter service has them (ROS: private parameters), turned into the configuration.

A node's own section stands flat, others nested by name: of ``hand_sign_recognition``, ``~min_confidence`` is
``signs.min_confidence`` and ``~landmarks/model`` is ``landmarks.model``.
"""

from collections.abc import Mapping
from typing import Any

from handsteer.config import Config, Section, validate
from handsteer.errors import ConfigError


def from_parameters(parameters: Mapping[str, Any], section: str, node: str) -> dict[str, Any]:
    """Return ``parameters`` nested as in :class:`~handsteer.config.Config`.

    Args:
        parameters: The node's private parameters, by name.
        section: The node's own section of the configuration.
        node: Full name of the node, for messages.

    Raises:
        ConfigError: A name is unknown or a value is not allowed; the message has the parameter's full name.
    """
    values: dict[str, Any] = {}
    for name, value in parameters.items():
        if name in _fields(section):
            values.setdefault(section, {})[name] = _checked(section, name, value, f"{node}/{name}")
        elif name in Config.model_fields and isinstance(value, Mapping):
            for inner, of in value.items():
                values.setdefault(name, {})[inner] = _checked(name, inner, of, f"{node}/{name}/{inner}")
        else:
            known = ", ".join(_fields(section))
            raise ConfigError(f"ROS parameter {node}/{name}: there is no such parameter; there are {known}")
    return values


def _checked(section: str, name: str, value: Any, full_name: str) -> Any:
    try:
        validate(Config, {section: {name: value}})
    except ConfigError as error:
        problem = str(error).removeprefix(f"{section}.{name}").removeprefix(": ")
        raise ConfigError(f"ROS parameter {full_name}: {problem}") from None
    return value


def _fields(section: str) -> list[str]:
    model = Config.model_fields[section].annotation
    assert isinstance(model, type)
    assert issubclass(model, Section)
    return list(model.model_fields)
