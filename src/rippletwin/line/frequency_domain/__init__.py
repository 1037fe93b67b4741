"""The line in the frequency domain: immittances, chained networks, nonlinear loads and compliances."""
