"""Checks what works on this machine, and suggests fixes for the rest.

Imports the kernel, and :mod:`~handsteer.plugins.dds`, whose configuration of the network it examines.
"""
