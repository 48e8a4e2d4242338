"""Recordings of a graph's topics: MCAP files as ROS 2 writes them, and bags of ROS 1 and 2; run again, and reports.

``recorder`` writes the topics of a graph to an MCAP file while it runs, ``recorded`` reads such files, whole or cut
off. ``audit_log`` writes the audit to a rotating log file. :mod:`~handsteer.plugins.record.replay` runs a recording
again, and reports on it.

Imports the kernel only.
"""
