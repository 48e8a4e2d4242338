"""The virtual hand: a kinematic hand, its poses of the signs, and the camera that renders it by a script.

Imports the kernel only.
"""
