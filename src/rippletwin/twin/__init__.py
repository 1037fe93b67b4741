"""The twin: rig, pump, line, load and effects with uncertain parameters, and what it predicts."""
