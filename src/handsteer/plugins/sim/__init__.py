"""The simulated robot: MuJoCo's physics behind the limits of a differential drive controller.

``simulated`` is a diff-drive controller like ROS's and its odometry, ``physics`` the world and the laser scanner.

Imports the kernel only.
"""
