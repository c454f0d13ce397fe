"""Machine code of the demo's kernels for a wheel: compiled for a common processor; a first run compiles nothing.

It is the cache that every run keeps (`bimvox.kernel_cache`): a file's name follows from everything that it was compiled
from, and what does not fit is not used.
"""

from __future__ import annotations

import os
import platform
import subprocess
import sys
from pathlib import Path

from bimvox.kernel_cache import COMMON

_PYTHON = f"cp{sys.version_info.major}{sys.version_info.minor}"
TAG = f"{_PYTHON}-{_PYTHON}-manylinux_2_17_x86_64"
"""What the wheel is for. The code links to nothing, so the oldest Linux will do for which numba has wheels."""


def can_compile() -> bool:
    """Return whether this machine can compile for the common processor: Linux on x86-64."""
    return (platform.system(), platform.machine()) == ("Linux", "x86_64")


def compile_into(folder: Path) -> int:
    """Compile the demo's kernels into a folder, in two processes, and return how many files that are.

    Raises:
        OSError: If they cannot be compiled.
    """
    processor, features = COMMON
    names = {"NUMBA_CPU_NAME": processor, "NUMBA_CPU_FEATURES": features, "NUMBA_CACHE_DIR": str(folder)}
    ways = ("forwards", "backwards")
    workers = [
        subprocess.Popen([sys.executable, "-m", "bimvox.kernel_list", way], env=os.environ | names) for way in ways
    ]
    codes = [worker.wait() for worker in workers]
    if any(codes):
        raise OSError("the machine code of the kernels cannot be compiled")
    for file in [*folder.rglob("*.lock"), *folder.rglob("*/*.part")]:  # modules end in ".part", too
        file.unlink()
    return sum(1 for _ in folder.rglob("*.nbc"))
