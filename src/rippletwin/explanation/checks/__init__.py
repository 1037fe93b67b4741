"""Whether data and fits may be believed: contradictions, alarms, cross-validation, sensitivity."""
