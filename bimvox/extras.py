"""The packages of the extras that `bimvox[full]` has and `bimvox` alone has not.

What needs one says so before it begins, in one sentence that names the extra.
"""

from __future__ import annotations

from importlib.util import find_spec

from bimvox.errors import MissingPackageError

EXTRAS: dict[str, tuple[str, ...]] = {
    "holidays": ("holidays",),
    "optimise": ("optuna",),
    "plots": ("matplotlib",),
    "train": ("torch", "stable_baselines3", "gymnasium"),
}
"""Modules of each extra, by the extra's name in pyproject.toml."""

_FROM = {"train": "--extra-index-url https://download.pytorch.org/whl/cpu "}
"""Options of pip: PyPI's build of torch for Linux brings CUDA, several GB."""


def missing(extra: str) -> str | None:
    """Return the first module of an extra that is not installed; None if all are."""
    return next((module for module in EXTRAS[extra] if find_spec(module) is None), None)


def require(extra: str, purpose: str) -> None:
    """Return if the packages of an extra are installed; they are not imported.

    Args:
        extra: A key of ``EXTRAS``.
        purpose: What needs them, as the beginning of a sentence.

    Raises:
        MissingPackageError: If one is missing; the hint says what to install.
    """
    if module := missing(extra):
        package = module.replace("_", "-")
        raise MissingPackageError(package, purpose, install=f'pip install {_FROM.get(extra, "")}"bimvox[{extra}]"')
