"""Calibration: posterior, optimiser and continuation that fit a twin to observations."""
