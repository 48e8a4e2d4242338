"""Makes the training data of the shipped sign model, and trains it.

``hands`` makes hands of the kinematic hand with the shapes of ``shapes``, named by ``truth``; ``people`` draws hands
from statistics of people's, which ``fit`` makes of the labelled photos that may be tuned on (``split``); ``default``
trains on both.
"""
