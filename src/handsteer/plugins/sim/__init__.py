"""The simulated robot: MuJoCo's physics behind the limits of a differential drive controller.

``diff_drive`` is a controller like ROS's and its odometry, ``physics`` the world and the laser scanner, ``walks`` who
walks in it; ``simulated`` is the robot of these.

Imports the kernel only.
"""
