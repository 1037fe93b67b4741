"""From recordings to complex spectra with a covariance."""
