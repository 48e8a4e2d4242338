#!/usr/bin/env python3
"""Turns signs into velocities (chapter 12 of the course): ``handsteer control`` as a ROS node."""

import os
import sys
from pathlib import Path

NODE = Path(__file__).resolve().parents[2] / "handsteer_node"
os.execv(NODE, [str(NODE), "control", *sys.argv[1:]])
