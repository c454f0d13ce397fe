"""One decorator for every compiled kernel."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numba

from bimvox.kernel_cache import KernelCache

F = TypeVar("F", bound=Callable[..., Any])


def kernel(function: F) -> F:
    """Compile ``function`` to machine code on first use, stored on disk; it runs without the GIL."""
    return _compiled(function)


def leaf_kernel(function: F) -> F:
    """Compile like :func:`kernel`, without reference counts for arrays.

    Counting is atomic and costs more than ten times what a table look-up costs. Only for functions that create no array
    and return none: they read and write arrays that their caller holds.
    """
    return _compiled(function, _nrt=False)


def inline_kernel(function: F) -> F:
    """Compile like :func:`leaf_kernel`, always into its callers.

    Passing an array to a function costs as much as ten look-ups. Only for small functions called in innermost loops.
    """
    return _compiled(function, _nrt=False, forceinline=True)


def _compiled(function: F, **options: bool) -> F:
    dispatcher = numba.njit(nogil=True, no_cfunc_wrapper=True, **options)(function)
    dispatcher._cache = KernelCache(dispatcher)
    return dispatcher  # type: ignore[no-any-return]
