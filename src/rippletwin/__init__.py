"""rippletwin: zero-shot fault diagnosis of axial piston pumps with a self-explaining twin."""

__version__ = "0.1.0"
