"""A DDS domain of its own for each test, and processes in it."""

import os
import random

# Domains above have no UDP ports; those of tests that run side by side must differ, as must those of others.
_LARGEST_DOMAIN = 100
_SHARES = 20


def free_domain() -> int:
    """Return the number of a domain that no test on another worker uses."""
    worker = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw")) % _SHARES
    return 1 + worker + _SHARES * random.randrange(_LARGEST_DOMAIN // _SHARES)
