"""The line in the frequency domain: immittances, networks, nonlinear loads and compliances."""
