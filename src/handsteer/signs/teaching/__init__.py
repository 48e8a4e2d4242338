"""Teaches further signs: collects takes of hands, learns what they have in common, and tells them from all other hands.

:mod:`~handsteer.signs.training`, its neighbour, makes the model of the six signs that handsteer ships.
"""
