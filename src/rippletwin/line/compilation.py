"""How the functions of an inner loop are compiled."""

from __future__ import annotations

from numba import njit

uncounted = njit(cache=True, error_model="numpy", _nrt=False)  # type: ignore[call-overload]
"""Decorator of functions that allocate no arrays. Numba then needs no reference counts of their
array views; counting them can take longer than a loop over a short line."""

summing = njit(cache=True, error_model="numpy", fastmath={"reassoc", "contract"}, _nrt=False)  # type: ignore[call-overload]
"""The same of sums whose order is free, which the compiler then vectorises."""
