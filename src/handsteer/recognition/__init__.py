"""Recognises hand signs: finds the 21 landmarks of hands in a frame, and classifies them.

:mod:`~handsteer.recognition.recognizer` runs the whole chain; ``hand`` defines its interfaces.

``landmarker`` finds hands with MediaPipe's models: ``search`` decides where and when to look for new ones, ``regions``
detects palms in the whole frame, and computes the region of a hand from its palm or its last landmarks.
``landmark_models`` locates, downloads and runs the model files. ``shipped_signs`` and ``custom_signs`` classify a hand
by its ``features`` with a ``network``; ``profile`` adapts the shipped signs to one person. ``filters`` select the
active hand, and confirm its sign.

Pre- and post-processing of the models are our own, and agree with MediaPipe's to a hundredth of a pixel.
``hand_joystick`` turns the active hand into a joystick (docs/driving.md). Code that only recognises signs loads no
messages, graph or robots.
"""
