"""The web page. It imports the graph, never the reverse."""
