"""Teaches further signs: collects takes of hands, and trains a model that distinguishes them from all other hands.

:mod:`~handsteer.signs.training` trains the model of the six shipped signs.
"""
