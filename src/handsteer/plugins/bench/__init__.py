"""A simulated operator drives the simulated robot over courses through different interfaces, and laps are measured.

The ``operator`` sees the robot on one of the ``courses`` a moment late, and acts through one of the ``interfaces``, or
through signs and the virtual hand (``hands``).

:func:`handsteer.plugins.bench.laps.run_lap` drives one lap on stepped time. Simulated laps are not a user study: they
compare interfaces and settings under the same model of a person (:doc:`/driving`).

Imports the kernel, and :mod:`~handsteer.plugins.sim` and :mod:`~handsteer.plugins.virtual_hand`, whose robot and hand
it drives.
"""
