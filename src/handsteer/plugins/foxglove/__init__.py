"""Serves the topics of a graph to Foxglove, PlotJuggler and other programs, by the Foxglove WebSocket protocol.

``server`` is the server on a WebSocket, ``protocol`` its messages, ``access`` its access control, ``feeds`` subscribes
to the topics that clients read, and holds the newest messages for a slow client. ``driving`` steers for the client that
has the seat, if clients may drive. ``process`` runs it in a separate process, like the page.

Imports the kernel only.
"""

# First, also in the process of its own: it loads the parameters of plug-ins, whose modules may import any other.
import handsteer.config  # noqa: F401
