"""The plug-ins: everything that not everybody needs to understand.

Each is one package, whose docstring says what it is and what it may import; the linter of imports checks that. The
kernel (all other packages of :mod:`handsteer`) imports none of them.
"""
