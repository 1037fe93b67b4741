"""Every picture rippletwin makes, in one style. Functions take arrays and return a Figure."""

from rippletwin.figures.style import save

__all__ = ["save"]
