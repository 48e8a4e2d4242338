"""Writes the tables of faults in docs/faults.md: ``python -m tests.faults``, or only some parts of them by name."""

import logging
import sys

from tests.faults import browser, networks, people, processes
from tests.faults.stepped import outcomes
from tests.faults.table import write

PARTS = {
    "stepped": lambda: list(outcomes().values()),
    "processes": processes.outcomes,
    "networks": networks.outcomes,
    "browser": browser.outcomes,
    "people": people.outcomes,
}


def main(parts: list[str]) -> None:
    logging.disable(logging.CRITICAL)  # what nodes say of the faults stands in the tables
    for part in parts or PARTS:
        write(part, PARTS[part]())


if __name__ == "__main__":
    main(sys.argv[1:])
