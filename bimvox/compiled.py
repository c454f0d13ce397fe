"""The decorators of compiled kernels."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, TypeVar

import numba
from numba.core import typed_passes, untyped_passes
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import PassManager
from numba.core.registry import cpu_target
from numba.core.types.misc import unliteral

from bimvox.kernel_cache import KernelCache, KernelCode
from bimvox.undisturbed import undisturbed

F = TypeVar("F", bound=Callable[..., Any])

# Numba's passes for what no kernel uses, and for people who look at one; all others see the same program without them.
_NEEDLESS = (
    untyped_passes.WithLifting,
    untyped_passes.RewriteDynamicRaises,
    untyped_passes.MakeFunctionToJitFunction,
    untyped_passes.InlineInlinables,
    untyped_passes.FindLiterallyCalls,
    untyped_passes.LiteralUnroll,
    untyped_passes.LiteralPropagationSubPipelinePass,
    typed_passes.InlineOverloads,
    typed_passes.AnnotateTypes,
    typed_passes.DumpParforDiagnostics,
)


class _Passes(CompilerBase):  # type: ignore[misc]  # numba has no types
    """Numba's own passes, in its order, without those that no kernel needs.

    Args:
        cache: That of the kernel.
        args: What numba passes.
    """

    def __init__(self, cache: KernelCache, *args: Any) -> None:
        super().__init__(*args)
        self._cache = cache

    def define_pipelines(self) -> list[Any]:
        """Return the passes, and prepare what they work on."""
        function, codegen = self.state.func_id, self.state.targetctx.codegen()
        function.unique_id = self._cache.symbol_tag(self.state.args, codegen)
        self.state.library = KernelCode(codegen, function.func_qualname)
        self.state.library.enable_object_caching()
        chosen = PassManager("kernel")
        for one, words in DefaultPassBuilder.define_nopython_pipeline(self.state).passes:
            if one not in _NEEDLESS:
                chosen.add_pass(one, words)
        chosen.finalize()
        return [chosen]


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
    """Return the kernel as Python calls it; ``callee()`` of it is the one that other kernels call.

    Numba makes each kernel a wrapper that reads its arguments from Python's objects. This takes a fifth of the time of
    compiling, and most kernels are called by kernels only. So the callee is compiled apart, without the wrapper.
    """
    dispatcher = _dispatcher(function, **options)

    @functools.cache
    def callee() -> Any:
        return _dispatcher(function, no_cpython_wrapper=True, **options)

    def without_literals(args: Sequence[Any], kws: dict[str, Any]) -> Any:
        """Resolve a call from another kernel by the types of its arguments alone.

        Otherwise numba compiles a kernel again for each constant that a caller passes.
        """
        resolve = callee().get_call_template
        return resolve([unliteral(one) for one in args], {name: unliteral(one) for name, one in kws.items()})

    def overload(signature: Any) -> Any:
        return callee().get_overload(signature)

    dispatcher.callee, dispatcher.get_call_template, dispatcher.get_overload = callee, without_literals, overload
    return dispatcher  # type: ignore[no-any-return]


@contextmanager
def _without_c_wrappers() -> Iterator[None]:
    """Let numba's own functions, too, be compiled without the wrappers through which C would call them."""
    context = cpu_target.target_context
    if "create_cfunc_wrapper" in vars(context):  # within the turn of a caller
        yield
        return
    context.create_cfunc_wrapper = lambda *_: None
    try:
        yield
    finally:
        del context.create_cfunc_wrapper


def _dispatcher(function: F, **options: bool) -> Any:
    dispatcher = numba.njit(nogil=True, no_cfunc_wrapper=True, **options)(function)
    cache = dispatcher._cache = KernelCache(dispatcher)
    dispatcher._compiler.pipeline_class = functools.partial(_Passes, cache)
    compile_one = dispatcher.compile

    def compile_once(signature: Any) -> Any:
        with undisturbed(), cache.turn(), _without_c_wrappers():
            return compile_one(signature)

    dispatcher.compile = compile_once
    return dispatcher
