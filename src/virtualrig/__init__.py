"""virtualrig: an independent time-domain stand-in for a hydraulic test bench."""
