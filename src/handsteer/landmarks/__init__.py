"""From a frame to the 21 landmarks of a hand.

``protocol`` says what every landmarker offers; ``mediapipe`` is the real one, ``recorded`` replays.

Inside the real one: ``search`` says where to look for new hands, ``palm`` finds palms in the whole frame, ``roi``
turns a palm (or the landmarks of the last frame) into the rotated square to look at, ``hand_landmark`` finds the
landmarks in that square, ``tflite`` runs the model files and ``models`` knows where those come from.
"""
