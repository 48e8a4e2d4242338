"""``python -m handsteer``."""

from handsteer.cli import main

main()
