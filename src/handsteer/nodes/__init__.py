"""The nodes of the graph: thin, one file each."""
