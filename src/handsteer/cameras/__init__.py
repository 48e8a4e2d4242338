"""Where frames come from: webcam, video file, folder of photos, virtual hand."""
