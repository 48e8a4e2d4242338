"""The command ``handsteer``: one file per verb. Only this package prints and exits."""

from handsteer.cli.main import main

__all__ = ["main"]
