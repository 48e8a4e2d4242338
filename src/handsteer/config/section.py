"""The base of all sections of the configuration."""

import logging
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, ClassVar, Final, get_args

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    JsonValue,
    ValidationInfo,
    field_validator,
    model_validator,
)

log = logging.getLogger(__name__)

# ROS parameters have no null.
EMPTY_IS_NONE: Final = BeforeValidator(lambda value: None if value == "" else value)
OptionalPath = Annotated[Path | None, EMPTY_IS_NONE]

_LIVE: Final[dict[str, JsonValue]] = {"live": True}
_OLD_NAMES_SEEN: set[str] = set()


class Values(BaseModel):
    """Named values; unknown names and values out of range are rejected."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, validate_default=True)

    @field_validator("*")
    @classmethod
    def without_null(cls, value: Any) -> Any:
        """Return ``value``; no system call takes a text with a null character as a name, path or address."""
        if isinstance(value, str | Path) and "\0" in str(value):
            raise ValueError("must have no null character")
        return value


class Section(Values):
    """A group of parameters.

    Attributes:
        live: Those that can change while a node runs; the others are read at start-up.
        renamed: New names of parameters by their old ones, which are still accepted.
    """

    live: ClassVar[frozenset[str]] = frozenset()
    renamed: ClassVar[Mapping[str, str]] = {}

    @classmethod
    def new_name(cls, name: str) -> str:
        """Return the current name of the parameter ``name``, and warn once of an old name."""
        new = cls.renamed.get(name, name)
        if new != name and name not in _OLD_NAMES_SEEN:
            _OLD_NAMES_SEEN.add(name)
            log.warning("parameter %s is deprecated: use %s", name, new)
        return new

    @field_validator("*", mode="before")
    @classmethod
    def no_boolean_for_a_number(cls, value: Any, field: ValidationInfo) -> Any:
        """Return ``value``; YAML reads on, off, yes and no as booleans, which would count as 1 and 0."""
        if isinstance(value, bool) and field.field_name:
            kind = cls.model_fields[field.field_name].annotation
            kinds = {kind, *get_args(kind)}
            if kinds & {int, float} and bool not in kinds:
                raise ValueError("should be a number, not true or false")
        return value

    @model_validator(mode="before")
    @classmethod
    def by_new_names(cls, values: Any) -> Any:
        """Return ``values`` with old names of parameters replaced by new ones, unless the new one is given too."""
        if not (isinstance(values, dict) and cls.renamed.keys() & values.keys()):
            return values
        renamed = {name: value for name, value in values.items() if name not in cls.renamed}
        for old in cls.renamed.keys() & values.keys():
            renamed.setdefault(cls.new_name(old), values[old])
        return renamed

    @classmethod
    def __pydantic_init_subclass__(cls, **_: Any) -> None:
        """Collect the fields made by :func:`live`."""
        cls.live = frozenset(name for name, field in cls.model_fields.items() if field.json_schema_extra == _LIVE)


def live(default: Any, **constraints: Any) -> Any:
    """Return a pydantic ``Field`` of a parameter that can change while its node runs."""
    return Field(default, json_schema_extra=_LIVE, **constraints)
