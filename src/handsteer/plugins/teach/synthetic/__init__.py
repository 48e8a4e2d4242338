"""Trains the model of the shipped signs on generated hands.

``hands`` generates synthetic hands with the kinematic hand and the shapes of ``shapes``, and labels them by their true
joints. ``people`` draws hands from statistics of people's, which ``fit`` computes from labelled photos. ``train``
trains on both.
"""
