"""Makes a Python on Linux behave, towards bimvox, as Windows does. Put this folder on ``PYTHONPATH``.

bimvox can import no POSIX-only module, cannot fork, and cannot replace or delete a file that it has open. A descriptor
that it opens without ``O_BINARY`` is refused (it would change line ends), and so is a folder opened as a file. Other
packages have builds for each system; they keep what they use here.
"""

import builtins
import os
import pathlib
import signal
import sys

MODULES = {"fcntl", "grp", "posix", "pty", "pwd", "readline", "resource", "syslog", "termios", "tty"}
OS_NAMES = ("fork", "forkpty", "killpg", "setsid", "sched_getaffinity", "getloadavg")
SIGNAL_NAMES = ("SIGALRM", "SIGHUP", "SIGUSR1", "SIGUSR2", "SIGCHLD", "setitimer", "alarm")
_BINARY = 1 << 30

for _name in OS_NAMES:
    if hasattr(os, _name):
        delattr(os, _name)
for _name in SIGNAL_NAMES:
    if hasattr(signal, _name):
        delattr(signal, _name)
os.O_BINARY = _BINARY


def _is_ours(depth: int) -> bool:
    return str(sys._getframe(depth + 1).f_globals.get("__name__", "")).startswith("bimvox")


def _import(name, spaces=None, *others, usual=builtins.__import__, **named):
    spaces = named.pop("globals", spaces)
    if name in MODULES and str((spaces or {}).get("__name__", "")).startswith("bimvox"):
        raise ModuleNotFoundError(f"No module named {name!r}", name=name)
    return usual(name, spaces, *others, **named)


def _open(path, flags, *others, usual=os.open, **named):
    if _is_ours(1) and isinstance(path, str | os.PathLike):
        if pathlib.Path(path).is_dir():
            raise PermissionError(13, "Permission denied", str(path))
        if not flags & _BINARY:
            raise AssertionError(f"{path} is opened without O_BINARY")
    return usual(path, flags & ~_BINARY, *others, **named)


def _held(path) -> bool:
    """Whether this process has the file open or mapped."""
    try:
        wanted = str(pathlib.Path(path).resolve())
    except (OSError, TypeError, ValueError):
        return False
    for one in pathlib.Path("/proc/self/fd").iterdir():
        try:
            if str(one.readlink()) == wanted:
                return True
        except OSError:
            continue
    maps = pathlib.Path("/proc/self/maps").read_text(encoding="utf-8").splitlines()
    return any(line.endswith(f" {wanted}") for line in maps)


def _guarded(usual, *, is_move):
    def call(source, *others, **named):
        for path in (source, *(others[:1] if is_move else ())):
            if not isinstance(path, int) and pathlib.Path(os.fsdecode(path)).is_file() and _held(path):
                raise PermissionError(13, "The process cannot access the file because it is being used", str(path))
        return usual(source, *others, **named)

    return call


builtins.__import__ = _import
os.open = _open
for _name, _moves in (("replace", True), ("rename", True), ("unlink", False), ("remove", False)):
    setattr(os, _name, _guarded(getattr(os, _name), is_move=_moves))
