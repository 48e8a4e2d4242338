#!/usr/bin/env python3
"""Turns signs into velocities (chapter 12 of the course): ``handsteer control`` as a ROS node."""

import os
import sys
from pathlib import Path

NODE = Path(__file__).resolve().parents[2] / "handsteer_node"
# In the course each word gives its twist from the first on. The parameter ~arming goes before this file.
COURSE = Path(__file__).resolve().with_name("course.yaml")
given = sys.argv[1:]
file = [] if any(word.startswith("--config") for word in given) else ["--config", str(COURSE)]
os.execv(NODE, [str(NODE), "control", *file, *given])
