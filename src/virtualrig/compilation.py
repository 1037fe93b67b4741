"""How the functions of a time step are compiled.

They make no array. So the references of their many views need not be counted, which takes a quarter
of a step otherwise.
"""

from numba import njit

step_function = njit(cache=True, error_model="numpy", _nrt=False)
