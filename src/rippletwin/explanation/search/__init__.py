"""Stepwise search over effects and their places."""
