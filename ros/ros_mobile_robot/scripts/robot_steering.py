#!/usr/bin/env python3
"""Steers by the sliders of the page (chapter 11 of the course): ``handsteer steering`` as a ROS node."""

import os
import sys
from pathlib import Path

NODE = Path(__file__).resolve().parents[2] / "handsteer_node"
os.execv(NODE, [str(NODE), "steering", *sys.argv[1:]])
