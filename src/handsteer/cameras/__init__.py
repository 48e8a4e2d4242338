"""Where frames come from: webcam, video file, folder of photos, virtual hand."""

import os

# OpenCV's own complaints about devices and files repeat what our errors say, in its own terms. It reads these once.
os.environ.setdefault("OPENCV_LOG_LEVEL", "OFF")
os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")
