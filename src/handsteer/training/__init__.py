"""Learns and measures signs; a running robot needs nothing of it.

:mod:`~handsteer.training.synthetic` trains the model of the shipped signs, :mod:`~handsteer.training.custom` that of a
person's own, and :mod:`~handsteer.training.evaluation` measures how well either is recognised.
"""
