"""Options that verbs share: those that come from the configuration."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from handsteer import config

Flag = Annotated[bool, Parameter(negative="")]
Parameters = Annotated[config.Config | None, Parameter(name="*", group="Every parameter (also in a --config file)")]
ConfigFile = Annotated[Path | None, Parameter(name="--config")]
