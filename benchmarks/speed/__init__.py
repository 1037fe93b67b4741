"""Speed of the tool beside that of other programs; `benchmarks/bench.py` runs it."""
