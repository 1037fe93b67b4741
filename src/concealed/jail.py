"""Confinement of a command to the files that it is given, by Landlock of the Linux kernel (5.13).

`python -m concealed.jail --read A --write B -- COMMAND` runs COMMAND so. The kernel enforces the
confinement for the process and all its children, whichever user runs them, and no process can
leave it. Source: Linux kernel documentation, userspace-api/landlock.
"""

import argparse
import ctypes
import os
import struct
import sys
from collections.abc import Iterable
from pathlib import Path

_CREATE_RULESET, _ADD_RULE, _RESTRICT_SELF = 444, 445, 446  # system calls, same on all machines
_ASK_VERSION, _PATH_BENEATH, _NO_NEW_PRIVILEGES = 1, 1, 38
_EXECUTE, _WRITE_FILE, _READ_FILE, _READ_DIR, _TRUNCATE = 1, 2, 4, 8, 1 << 14
_RIGHTS_BY_VERSION = {1: (1 << 13) - 1, 2: (1 << 14) - 1, 3: (1 << 15) - 1}
_RIGHTS_OF_FILES = _EXECUTE | _WRITE_FILE | _READ_FILE | _TRUNCATE
_READ = _EXECUTE | _READ_FILE | _READ_DIR
_LIST = _READ_DIR


class JailError(RuntimeError):
    """The kernel cannot confine a process."""


def landlock_version() -> int:
    """Version of the kernel's Landlock interface; 0 where there is none."""
    if not sys.platform.startswith("linux"):
        return 0
    return max(_libc().syscall(_CREATE_RULESET, None, 0, _ASK_VERSION), 0)


def confine(read: Iterable[str], write: Iterable[str], listed: Iterable[str] = ()) -> None:
    """Confine this process, for good, to the given files and folders with all that they contain.

    It can read and execute `read`, also write `write`, and list the names below `listed` without
    opening the files. Paths that do not exist are ignored. Raises JailError where the kernel has no
    Landlock or refuses.
    """
    version = landlock_version()
    if version < 1:
        raise JailError("this kernel has no Landlock (Linux 5.13 and later, switched on)")
    handled = _RIGHTS_BY_VERSION[min(version, 3)]
    libc = _libc()
    ruleset = libc.syscall(_CREATE_RULESET, struct.pack("Q", handled), 8, 0)
    if ruleset < 0:
        raise JailError(f"Landlock refuses: {os.strerror(ctypes.get_errno())}")
    for paths, rights in ((read, _READ), (write, handled), (listed, _LIST)):
        for path in paths:
            _add_rule(libc, ruleset, path, rights & handled)
    if libc.prctl(_NO_NEW_PRIVILEGES, 1, 0, 0, 0) or libc.syscall(_RESTRICT_SELF, ruleset, 0):
        raise JailError(f"Landlock refuses: {os.strerror(ctypes.get_errno())}")
    os.close(ruleset)


def _add_rule(libc, ruleset: int, path: str, rights: int) -> None:
    if not os.path.exists(path):
        return
    if not os.path.isdir(path):
        rights &= _RIGHTS_OF_FILES
    handle = os.open(path, os.O_PATH | os.O_CLOEXEC)
    rule = struct.pack("=Qi", rights, handle)
    if rights and libc.syscall(_ADD_RULE, ruleset, _PATH_BENEATH, rule, 0):
        raise JailError(f"{path}: Landlock refuses: {os.strerror(ctypes.get_errno())}")
    os.close(handle)


def _libc():
    return ctypes.CDLL(None, use_errno=True)


def paths_of_tool(source: Path) -> dict[str, list[str]]:
    """The paths that `rippletwin` needs, as arguments of `confine`; `source` holds its package.

    These are Python, the system's libraries, and of the devices the null device and the random
    numbers. Without shared memory (/dev/shm) it runs in one process. Python's import lists `source`
    itself.
    """
    python = {sys.prefix, sys.base_prefix, os.path.dirname(os.path.realpath(sys.executable))}
    system = ["/usr", "/lib", "/lib64", "/bin", "/etc", "/proc", "/sys", "/dev/urandom"]
    return {
        "read": [*python, *system, str(source / "rippletwin"), str(source / "concealed")],
        "write": ["/dev/null"],
        "listed": [str(source)],
    }


def main(arguments: list[str] | None = None) -> None:
    """Confine this process and replace it by COMMAND."""
    parser = argparse.ArgumentParser(prog="concealed.jail", description=__doc__.splitlines()[0])
    parser.add_argument("--read", action="append", default=[])
    parser.add_argument("--write", action="append", default=[])
    parser.add_argument("command", nargs="+")
    options = parser.parse_args(arguments)
    tool = paths_of_tool(Path(__file__).resolve().parent.parent)
    confine(tool["read"] + options.read, tool["write"] + options.write, tool["listed"])
    os.execvp(options.command[0], options.command)


if __name__ == "__main__":
    main()
