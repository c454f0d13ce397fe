"""The score of a policy from anywhere: the shipped one, a stored one, an ONNX file, a Python function."""

from __future__ import annotations

import hashlib
import importlib
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bimvox.errors import InputError, MissingPackageError, PolicyError
from bimvox.files import read_input

if TYPE_CHECKING:
    from bimvox.planning.rollout import TowardsTarget, Values
    from bimvox.progress import Progress


def score_policy(policy: str, *, sets: Sequence[str] = (), share: float = 1.0, progress: Progress) -> dict[str, Any]:
    """Score a policy on the frozen held-out suite.

    Args:
        policy: ``default`` (the shipped network), ``greedy``, an id of the store, ``FILE.onnx``, or
            ``module:function``, whose code runs.
        sets: Names of sets; default: all.
        share: Of each set, above 0, at most 1.
        progress: Counts the problems.

    Returns:
        The document of ``bimvox policy score --json``.

    Raises:
        PolicyError: The policy cannot be loaded or fails, or a problem is not the frozen one.
        InputError: There is no such set, or the share is outside 0 to 1.
    """
    from bimvox.policy.score import chosen_sets, score

    if not 0.0 < share <= 1.0:
        raise InputError(f"--share {share:g}: a share is above 0 and at most 1")
    chosen = chosen_sets(sets)
    identity, values = _loaded(policy)
    return score(identity, values, chosen, share, progress).model_dump(mode="json")


def _loaded(policy: str) -> tuple[str, Values | TowardsTarget]:
    """Return what names a policy in a result, and the policy."""
    if policy.lower().endswith(".onnx"):
        return _from_onnx(Path(policy))
    if ":" in policy:
        return policy, _from_module(policy)
    from bimvox.planning.rollout import GREEDY
    from bimvox.policy.choice import DEFAULT_START, GREEDY_POLICY

    if policy == GREEDY_POLICY.id:
        return policy, GREEDY
    if policy == DEFAULT_START:
        from bimvox.policy.generalist.weights import generalist_record, load_generalist

        return str(generalist_record()["id"]), load_generalist()
    from bimvox.policy import store

    found = store.load(policy)
    return found.manifest.id, found.network


def _from_onnx(file: Path) -> tuple[str, Values]:
    content = read_input(file)
    try:
        runtime = importlib.import_module("onnxruntime")
    except ImportError as error:
        raise MissingPackageError("onnxruntime", "scoring an ONNX file") from error
    try:
        session = runtime.InferenceSession(content, providers=["CPUExecutionProvider"])
        (name,) = [one.name for one in session.get_inputs()]
    except Exception as error:  # onnxruntime raises kinds of its own
        raise PolicyError(f"{file}: not an ONNX model with one input") from error
    return hashlib.sha256(content).hexdigest()[:16], lambda observations: session.run(None, {name: observations})[0]


def _from_module(policy: str) -> Values:
    """Return a function of a module on the path or in the current folder."""
    module, _, name = policy.partition(":")
    sys.path.insert(0, "")
    try:
        found = getattr(importlib.import_module(module), name, None)
    except Exception as error:  # of anyone's code
        raise PolicyError(
            f"{policy}: the module cannot be imported: {type(error).__name__}: {error}",
            hint="module:function, the module on Python's path or in the current folder",
        ) from error
    finally:
        sys.path.remove("")
    if not callable(found):
        raise PolicyError(f"{policy}: the module has no function {name!r}")
    values: Values = found
    return values
