"""Every picture, in one style. Functions take arrays and return a Figure."""
