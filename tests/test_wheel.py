"""The wheel, installed alone, has the command line."""

import os
import subprocess
import sys
import venv

import pytest

from case_folders import sheet, write_case
from paths import ROOT


@pytest.mark.long
def test_wheel_has_the_command_line_without_snakemake(tmp_path):
    """Built from a copy of the sources and unpacked into a fresh environment that sees this one's
    libraries but not this repository nor Snakemake: the programs answer, a case is checked, and
    templates and schemas are there."""
    source = tmp_path / "source"
    files = subprocess.run(["git", "ls-files", "src", "*.toml", "*.md", "LICENSE"], cwd=ROOT,
                           capture_output=True, text=True, check=True).stdout.split()  # fmt: skip
    for name in files:
        (source / name).parent.mkdir(parents=True, exist_ok=True)
        (source / name).write_bytes((ROOT / name).read_bytes())
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check"]
    build = ["wheel", "--no-deps", "--no-build-isolation", "--wheel-dir", tmp_path, source]
    subprocess.run([*pip, *build], check=True, capture_output=True)
    (wheel,) = tmp_path.glob("rippletwin-*.whl")

    venv.create(tmp_path / "fresh", with_pip=False)
    python = tmp_path / "fresh" / "bin" / "python"
    target = subprocess.run(
        [python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))"],
        check=True, capture_output=True, text=True,
    ).stdout.strip()  # fmt: skip
    subprocess.run(
        [*pip, "--python", python, "install", "--no-deps", "--no-index", wheel],
        check=True, capture_output=True,
    )  # fmt: skip
    libraries = next(path for path in sys.path if path.endswith("site-packages"))
    hook = "import sys; sys.modules['snakemake'] = None; "
    hook += f"sys.path.append({libraries!r})\n"
    with open(f"{target}/libraries.pth", "w") as file:
        file.write(hook)

    clean = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    case = tmp_path / "case"
    case.mkdir()
    write_case(case, sheet())
    programs = tmp_path / "fresh" / "bin"
    for command in (
        [programs / "rippletwin", "--version"],
        [programs / "virtualrig", "--help"],
        [programs / "rippletwin", "check", case],
        [programs / "rippletwin", "report", case, "--out", tmp_path / "report.html"],
    ):
        done = subprocess.run(command, cwd=tmp_path, env=clean, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
    where = "import rippletwin; print(rippletwin.__file__)"
    found = subprocess.run(
        [python, "-c", where], cwd=tmp_path, env=clean, capture_output=True, text=True
    )
    assert found.stdout.startswith(str(tmp_path / "fresh"))
