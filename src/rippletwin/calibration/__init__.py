"""Calibration: two error models, and one engine that fits a twin under either."""
