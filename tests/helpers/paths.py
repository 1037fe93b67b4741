"""Where tests find the repository, and the real measurements where there are any."""

from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
MEASURED = ROOT.parent / "shared" / "measured"
"""Real measurements, kept outside the repository; tests that need them skip without."""
