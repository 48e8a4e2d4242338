"""Sources of frames: webcam, video file, folder of photos, virtual hand, browser."""

import os

# OpenCV's own messages about devices and files repeat our errors in other terms. It reads these variables once.
os.environ.setdefault("OPENCV_LOG_LEVEL", "OFF")
os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")
