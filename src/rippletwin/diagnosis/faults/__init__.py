"""Faults as hypotheses, one file each."""
