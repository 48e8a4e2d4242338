"""Generates the training data of the shipped sign model, and trains it.

``hands`` generates synthetic hands with the kinematic hand and the shapes of ``shapes``, labelled by ``truth``.
``people`` draws hands from statistics of people's, which ``fit`` computes from labelled photos. ``default`` trains on
both.
"""
