#!/usr/bin/env python3
"""Publishes the frames of a camera (chapter 7 of the course): ``handsteer camera`` as a ROS node."""

import os
import sys
from pathlib import Path

NODE = Path(__file__).resolve().parents[2] / "handsteer_node"
os.execv(NODE, [str(NODE), "camera", *sys.argv[1:]])
