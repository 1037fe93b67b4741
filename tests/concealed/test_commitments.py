"""Commitments: digests of files."""

import subprocess

from concealed.commitments import sha256_of_files


def test_a_changed_verdict_changes_its_digest(tmp_path):
    """Digests are those of the program sha256sum; one more blank changes them."""
    path = tmp_path / "verdict.json"
    path.write_text("{}")
    listed = subprocess.run(["sha256sum", path], capture_output=True, text=True, check=True).stdout
    before = sha256_of_files([path])
    assert before == {str(path): listed.split()[0]}
    path.write_text("{ }")
    assert sha256_of_files([path]) != before
