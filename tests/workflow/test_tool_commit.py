"""Which tool a trial tries: the hash of its source in the commit."""

import subprocess

import pytest
from snakemake.exceptions import WorkflowError

from tool_commit import TOOL, not_committed, tool_commit


@pytest.fixture
def checkout(tmp_path):
    """A git repository with a tool and a page, and a function that commits what has changed."""

    def git(*arguments):
        author = ["-c", "user.name=a", "-c", "user.email=a@example.org"]
        subprocess.run(["git", "-C", tmp_path, *author, *arguments], check=True)

    def commit():
        git("add", "--all")
        git("commit", "--quiet", "--message", "x")

    git("init", "--quiet")
    (tmp_path / TOOL).mkdir(parents=True)
    (tmp_path / TOOL / "tool.py").write_text("1\n")
    (tmp_path / "page.md").write_text("1\n")
    commit()
    return tmp_path, commit


def test_the_hash_is_of_the_tool_alone(checkout):
    """A commit of the page leaves the hash, a commit of the tool changes it."""
    folder, commit = checkout
    first = tool_commit(folder)
    (folder / "page.md").write_text("2\n")
    commit()
    assert tool_commit(folder) == first
    (folder / TOOL / "tool.py").write_text("2\n")
    commit()
    assert tool_commit(folder) != first


def test_an_edited_tool_is_told_from_the_committed_one(checkout):
    """Edited or with a new file it differs from the commit; an edited page does not matter."""
    folder, commit = checkout
    (folder / "page.md").write_text("2\n")
    assert not not_committed(folder)
    (folder / TOOL / "more.py").write_text("1\n")
    assert not_committed(folder)
    commit()
    assert not not_committed(folder)
    (folder / "workflow").mkdir()  # its rules confine the tool, its scripts compare digests
    (folder / "workflow" / "score.py").write_text("1\n")
    assert not_committed(folder)


def test_a_folder_without_git_is_an_error_that_says_so(tmp_path):
    """The cases follow from the commit, so there are none without one."""
    with pytest.raises(WorkflowError, match="run it in a git checkout"):
        tool_commit(tmp_path)
