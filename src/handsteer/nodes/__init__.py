"""The nodes of the graph, one file each, with little logic of their own.

Each runs on a thread of its own, which serves inboxes and timers one at a time, so the parts need no locks (``base``,
``callbacks``). ``auditing`` publishes transitions, at a limited rate, and ``run_recording`` starts and ends recordings.
A callback that raises is logged with its topic and counted, and the node continues. What a node reports is a dataclass
of ``status``; ``diagnostics`` turns it into a message and back, whatever comes from outside. ``supervision`` keeps the
state of Stop in every node, ``timing`` detects stalls and old frames, and ``surroundings`` is the world around the
robot: its changes, course and markers.
"""
