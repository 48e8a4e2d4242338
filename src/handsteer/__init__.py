"""Drive a mobile robot with your hand signs.

Start reading at :mod:`handsteer.graph`: it shows the whole flow on one page.
"""

__version__ = "0.1.0"
