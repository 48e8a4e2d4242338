"""A simulated operator drives the simulated robot over courses through different interfaces, and laps are measured.

:func:`handsteer.bench.laps.run_lap` drives one lap on stepped time. Simulated laps are no user study: they compare
interfaces and settings under the same model of a person (:doc:`/driving`).
"""
