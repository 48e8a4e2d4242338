"""Runs recordings through today's software, compares the results with the recorded ones, and reports on a drive.

``nodes.journal`` notes in each recording what a node has read from outside in each spin: messages, the readings of its
clock, answers of the transport. ``rerun`` gives a new node the same, so that its results are the same bit for bit,
however the machine was disturbed (docs/recordings.md). ``drive_reader`` reads a recording once into ``drive_facts``,
which ``report`` makes a page of; ``reason_log`` finds motion without a live reason.
"""
