"""How the functions of a time step are compiled.

They allocate no arrays. Numba then needs no reference counts of their array views; counting them
takes a quarter of a step.
"""

from numba import njit

step_function = njit(cache=True, _nrt=False)
vectorised_step_function = njit(cache=True, error_model="numpy", _nrt=False)
"""Without Python's check of each divisor, which the compiler does not vectorise."""
