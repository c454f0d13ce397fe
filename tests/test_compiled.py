"""What holds for all compiled kernels."""

from __future__ import annotations

import importlib
import pkgutil

from numba.core.dispatcher import Dispatcher

import bimvox


def _kernels():
    """Return every kernel of the package by its module and name."""
    found = {}
    for module in pkgutil.walk_packages(bimvox.__path__, "bimvox."):
        for value in vars(importlib.import_module(module.name)).values():
            if isinstance(value, Dispatcher) and value.py_func.__module__.startswith("bimvox."):
                found[value.py_func.__module__, value.py_func.__name__] = value
    return found


def _counts(dispatcher) -> bool:
    """Return whether a kernel counts the references of its arrays."""
    return bool(dispatcher.targetoptions.get("_nrt", True))


def test_no_kernel_without_reference_counts_calls_one_with_them():
    """Its callee would count up what it never counts down, or the reverse: memory would be freed too early."""
    kernels = _kernels()
    assert len(kernels) > 200
    wrong = [
        f"{module}: {name} calls {called}"
        for (module, name), dispatcher in kernels.items()
        if not _counts(dispatcher)
        for called in dispatcher.py_func.__code__.co_names
        if isinstance(one := dispatcher.py_func.__globals__.get(called), Dispatcher) and _counts(one)
    ]
    assert wrong == []
