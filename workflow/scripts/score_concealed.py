"""Opens the seals, if nothing was changed since the verdicts were committed to, and scores."""

import json
from pathlib import Path

from concealed.commitments import digests
from concealed.score import score
from job import start
from virtualrig.seal import open_seal_file

tell = start(snakemake)
paths = snakemake.input
committed = json.loads(Path(paths.commitments[0]).read_text())
found = digests([*paths.seals, *paths.verdicts, *paths.baselines])
changed = [path for path, digest in found.items() if committed.get(path) != digest]
if changed:
    raise ValueError(f"changed since the verdicts were committed to: {', '.join(changed)}")


def read(path: str) -> dict:
    return json.loads(Path(path).read_text())


rows = []
for case, (seal, key, *written) in enumerate(
    zip(paths.seals, paths.seal_keys, paths.verdicts, paths.baselines, paths.worths, strict=True)
):
    truth = open_seal_file(seal, key)
    verdict, baselines, oracle = map(read, written)
    rows.append({"case": case} | score(truth, verdict, baselines, oracle["worth"]))
Path(snakemake.output.rows).write_text(json.dumps(rows, indent=1) + "\n")
tell(f"{len(rows)} cases scored")
