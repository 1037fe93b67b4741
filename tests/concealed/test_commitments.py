"""Commitments: digests of files."""

import subprocess

import pytest

from concealed.commitments import check_unchanged, sha256_of_files


def test_a_changed_verdict_changes_its_digest(tmp_path):
    """Digests are those of the program sha256sum; one more blank changes them."""
    path = tmp_path / "verdict.json"
    path.write_text("{}")
    listed = subprocess.run(["sha256sum", path], capture_output=True, text=True, check=True).stdout
    before = sha256_of_files([path])
    assert before == {str(path): listed.split()[0]}
    path.write_text("{ }")
    assert sha256_of_files([path]) != before


def test_files_that_differ_from_their_commitment_are_named(tmp_path):
    """One of two has changed, a third was never committed to: both are named, the other is not."""
    kept, changed, new = paths = [tmp_path / name for name in ("kept", "changed", "new")]
    for path in paths:
        path.write_text("verdict")
    committed = sha256_of_files([kept, changed])
    check_unchanged(committed, [kept, changed])
    changed.write_text("another verdict")
    with pytest.raises(ValueError, match="committed to") as caught:
        check_unchanged(committed, paths)
    named = str(caught.value)
    assert str(changed) in named and str(new) in named and str(kept) not in named
