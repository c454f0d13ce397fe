"""The decorators of compiled kernels."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import numba
from numba.core.types.misc import unliteral

from bimvox.kernel_cache import KernelCache

F = TypeVar("F", bound=Callable[..., Any])


def kernel(function: F) -> F:
    """Compile ``function`` to machine code on first use and store it on disk; it runs without the GIL."""
    return _compiled(function)


def leaf_kernel(function: F) -> F:
    """Compile like :func:`kernel`, without reference counts for arrays.

    Counting is atomic and costs more than ten table look-ups. Only for functions that neither create nor return an
    array: their caller keeps the arrays alive.
    """
    return _compiled(function, _nrt=False)


def inline_kernel(function: F) -> F:
    """Compile like :func:`leaf_kernel`, and always inline into the callers.

    Passing an array to a function costs as much as ten look-ups. Only for small functions in innermost loops.
    """
    return _compiled(function, _nrt=False, forceinline=True)


def _compiled(function: F, **options: bool) -> F:
    dispatcher = numba.njit(nogil=True, no_cfunc_wrapper=True, **options)(function)
    cache = dispatcher._cache = KernelCache(dispatcher)
    compile_one, resolve = dispatcher.compile, dispatcher.get_call_template

    def compile_once(signature: Any) -> Any:
        with cache.turn():
            return compile_one(signature)

    def without_literals(args: Sequence[Any], kws: dict[str, Any]) -> Any:
        """Resolve a call from another kernel by the types of its arguments alone.

        Otherwise numba compiles a kernel again for each constant that a caller passes.
        """
        return resolve([unliteral(one) for one in args], {name: unliteral(one) for name, one in kws.items()})

    dispatcher.compile, dispatcher.get_call_template = compile_once, without_literals
    return dispatcher  # type: ignore[no-any-return]
