"""Diagnosis of recordings of unknown state by the twin itself, anchored to a healthy recording."""
