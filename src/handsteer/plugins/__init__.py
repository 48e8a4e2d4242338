"""The plug-ins: everything that not everybody needs to understand.

Each is one package, with a docstring that says what it is and which packages beside the kernel it may import; the
linter of imports checks that. The kernel (all other packages of :mod:`handsteer`) imports none of them.
"""
