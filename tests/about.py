"""A number that need not be exact, inside of a value that a test compares with."""

from typing import Any

import pytest


def about(value: float, abs: float | None = None) -> Any:
    """Return what equals ``value`` nearly, as ``pytest.approx`` says; it may stand wherever a number may."""
    return pytest.approx(value, abs=abs)
