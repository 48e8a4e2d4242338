#!/usr/bin/env python3
"""Simulates the robot, in Gazebo's place (chapter 11 of the course): ``handsteer robot`` as a ROS node."""

import os
import sys
from pathlib import Path

NODE = Path(__file__).resolve().parents[2] / "handsteer_node"
os.execv(NODE, [str(NODE), "robot", *sys.argv[1:]])
