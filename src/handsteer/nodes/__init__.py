"""The nodes of the graph, one file each, with little logic of their own."""
