"""Makes the training data of the shipped sign model out of the kinematic hand, and trains it."""
