"""Serves the topics of a graph to Foxglove, PlotJuggler and other programs, by the Foxglove WebSocket protocol."""
