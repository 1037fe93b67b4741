"""Run one benchmark in this process and write its record.

python -m speed.run_one NAME FILE [--quick]
"""

from __future__ import annotations

import importlib
import json
import sys
import time
from pathlib import Path

from speed import machine


def main() -> None:
    name, file, *quick = sys.argv[1:]
    start = time.perf_counter()
    benchmark = importlib.import_module(f"speed.{name}")
    result = benchmark.run(quick=bool(quick))
    record = {
        "name": name,
        "machine": machine.describe(),
        "peers": machine.versions(machine.PEERS) | getattr(benchmark, "OTHER_VERSIONS", {}),
        "wall_seconds": round(time.perf_counter() - start, 1),
        "result": result.to_json(),
    }
    Path(file).write_text(json.dumps(record, indent=1, ensure_ascii=False) + "\n")


if __name__ == "__main__":
    main()
