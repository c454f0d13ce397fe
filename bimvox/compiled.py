"""One decorator for every compiled kernel.

Numba's on-disk cache looks only at the file of the function itself: a cached caller keeps the old code of a callee
that changed in another file. So the cache folder is named after the sources of the whole library, and a change of any
of them starts a fresh one.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import platformdirs

F = TypeVar("F", bound=Callable[..., Any])


def _digest_of_kernels() -> str:
    """Hash every source of the library that holds a kernel."""
    digest = hashlib.sha256()
    for source in sorted(Path(__file__).parent.rglob("*.py")):
        text = source.read_bytes()
        if b"bimvox.compiled" in text:
            digest.update(source.name.encode() + b"\0" + text)
    return digest.hexdigest()[:16]


if "NUMBA_CACHE_DIR" not in os.environ:
    os.environ["NUMBA_CACHE_DIR"] = str(Path(platformdirs.user_cache_dir("bimvox")) / "kernels" / _digest_of_kernels())

import numba  # noqa: E402  (after the cache folder is set: numba reads it when it is imported)

numba.config.CACHE_DIR = os.environ["NUMBA_CACHE_DIR"]


def kernel(function: F) -> F:
    """Compile ``function`` to machine code on first use, cached on disk, the GIL released while it runs."""
    return numba.njit(cache=True, nogil=True)(function)  # type: ignore[no-any-return]


def leaf_kernel(function: F) -> F:
    """Compile like :func:`kernel`, without counting references to arrays.

    Counting them is atomic, and costs more than ten times what a look-up in a table does. Only for functions that
    create no array and return none: they read and write arrays that their caller holds.
    """
    return numba.njit(cache=True, nogil=True, _nrt=False)(function)  # type: ignore[no-any-return]


def inline_kernel(function: F) -> F:
    """Compile like :func:`leaf_kernel`, always into its callers.

    Passing an array to a function costs as much as ten look-ups. Only for small functions called in innermost loops.
    """
    return numba.njit(cache=True, nogil=True, _nrt=False, forceinline=True)(function)  # type: ignore[no-any-return]
