"""Missing physics: search, localisation, checks and verdict."""
