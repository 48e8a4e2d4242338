"""The web page: it imports the graph, never the reverse."""
