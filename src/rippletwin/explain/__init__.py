"""Missing physics: detect it, locate it, describe it, name it, validate it, and say so."""
