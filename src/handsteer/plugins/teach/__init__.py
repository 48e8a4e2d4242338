"""Learns and measures signs; a running robot needs nothing of it.

``collect``, ``dataset`` and ``train`` make further signs (docs/teach.md, docs/dataset.md); next to a running graph they
train in a separate process (``background``), which blocks neither the interpreter nor all processors. ``calibration``
makes a person's profile (docs/calibrate.md). ``evaluation`` reads labelled pictures, landmarks and videos
(docs/signs-evaluate.md). ``onnx_file`` writes taught signs for ONNX Runtime, with the features as a graph: a change to
those of ``recognition.features`` or ``recognition.custom_signs`` is made there too, which its tests check. ``effects``
says what signs do. ``terminal`` shows the hand, and reads keys, where there is no screen.

The modules here teach a person's own signs, :mod:`~handsteer.plugins.teach.synthetic` trains the model of the shipped
ones, and :mod:`~handsteer.plugins.teach.evaluation` measures how well either is recognised.

Imports the kernel, and :mod:`~handsteer.plugins.record`, to learn from recordings, and
:mod:`~handsteer.plugins.virtual_hand`, whose joints vary.
"""
