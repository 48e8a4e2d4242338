"""Features of ROS 2 that are independent of the middleware: names, arguments, and encoding of messages."""
