"""The diagnosis trial: how often `rippletwin diagnose` is right on a population of rigs."""
