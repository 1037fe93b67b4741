"""The lumped chamber pump: from geometry and leaks to the flow ripple at the outlet."""
