"""Recordings of a graph's topics: MCAP files as ROS 2 writes them, and bags of ROS 1 and 2."""
