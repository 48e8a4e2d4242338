"""Finds the 21 landmarks of hands in a frame.

``hand`` defines the interface of landmarkers; ``mediapipe`` implements it, ``recorded`` replays hands.

``mediapipe`` uses ``search``, which decides where to look for new hands, ``stillness``, which decides when, ``palm``,
which detects palms in the whole frame, and ``roi``, which computes the region of a hand from its palm or its last
landmarks. ``tflite`` runs the model files, and ``models`` locates and downloads them.
"""
