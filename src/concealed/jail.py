"""A command that may open only what it is given, by Landlock of the Linux kernel (5.13 and later).

The kernel enforces it for the process and all its children, whoever they run as, and nothing takes
it back. `python -m concealed.jail --read A --write B -- COMMAND` runs COMMAND so.
Source: Linux kernel documentation, userspace-api/landlock.
"""

import argparse
import ctypes
import os
import struct
import sys
from collections.abc import Iterable
from pathlib import Path

_CREATE_RULESET, _ADD_RULE, _RESTRICT_SELF = 444, 445, 446  # system calls, same on all machines
_VERSION, _PATH_BENEATH, _NO_NEW_PRIVILEGES = 1, 1, 38
_EXECUTE, _WRITE_FILE, _READ_FILE, _READ_DIR = 1, 2, 4, 8
# rights by version of the interface: 13 at first, then refer, truncate, (network), ioctl
_RIGHTS = {1: (1 << 13) - 1, 2: (1 << 14) - 1, 3: (1 << 15) - 1}
_OF_FILES = _EXECUTE | _WRITE_FILE | _READ_FILE | (1 << 14)
READ = _EXECUTE | _READ_FILE | _READ_DIR
LIST = _READ_DIR


class JailError(RuntimeError):
    """The kernel cannot confine a process."""


def version() -> int:
    """Version of the kernel's Landlock; 0 where there is none."""
    if not sys.platform.startswith("linux"):
        return 0
    return max(_libc().syscall(_CREATE_RULESET, None, 0, _VERSION), 0)


def confine(read: Iterable[str], write: Iterable[str], listed: Iterable[str] = ()) -> None:
    """From now on this process reads below `read`, reads and writes below `write`, nothing else.

    Folders below `listed` can be listed and the files in them not opened. Paths that do not exist
    are left out. Raises JailError where the kernel has no Landlock or refuses.
    """
    known = version()
    if known < 1:
        raise JailError("this kernel has no Landlock (Linux 5.13 and later, switched on)")
    handled = _RIGHTS[min(known, 3)]
    libc = _libc()
    ruleset = libc.syscall(_CREATE_RULESET, struct.pack("Q", handled), 8, 0)
    if ruleset < 0:
        raise JailError(f"Landlock refuses: {os.strerror(ctypes.get_errno())}")
    for paths, rights in ((read, READ), (write, handled), (listed, LIST)):
        for path in paths:
            _allow(libc, ruleset, path, rights & handled)
    if libc.prctl(_NO_NEW_PRIVILEGES, 1, 0, 0, 0) or libc.syscall(_RESTRICT_SELF, ruleset, 0):
        raise JailError(f"Landlock refuses: {os.strerror(ctypes.get_errno())}")
    os.close(ruleset)


def _allow(libc, ruleset: int, path: str, rights: int) -> None:
    if not os.path.exists(path):
        return
    if not os.path.isdir(path):
        rights &= _OF_FILES
    handle = os.open(path, os.O_PATH | os.O_CLOEXEC)
    rule = struct.pack("=Qi", rights, handle)
    if rights and libc.syscall(_ADD_RULE, ruleset, _PATH_BENEATH, rule, 0):
        raise JailError(f"{path}: Landlock refuses: {os.strerror(ctypes.get_errno())}")
    os.close(handle)


def _libc():
    return ctypes.CDLL(None, use_errno=True)


def of_tool(source: Path) -> dict[str, list[str]]:
    """What running `rippletwin` takes: Python, system libraries, its own source in `source`.

    `source` itself may be listed, which Python's import needs.
    """
    python = {sys.prefix, sys.base_prefix, os.path.dirname(os.path.realpath(sys.executable))}
    system = ["/usr", "/lib", "/lib64", "/bin", "/etc", "/proc", "/sys"]
    return {
        "read": [*python, *system, str(source / "rippletwin"), str(source / "concealed")],
        "write": ["/dev"],
        "listed": [str(source)],
    }


def main(arguments: list[str] | None = None) -> None:
    """Confine this process and become COMMAND."""
    parser = argparse.ArgumentParser(prog="concealed.jail", description=__doc__.splitlines()[0])
    parser.add_argument("--read", action="append", default=[])
    parser.add_argument("--write", action="append", default=[])
    parser.add_argument("command", nargs="+")
    options = parser.parse_args(arguments)
    tool = of_tool(Path(__file__).resolve().parent.parent)
    confine(tool["read"] + options.read, tool["write"] + options.write, tool["listed"])
    os.execvp(options.command[0], options.command)


if __name__ == "__main__":
    main()
