"""Planning and proving in rounds: lifts that fail their proof are refused, and the rest is planned and proven again."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TypeVar

from bimvox.errors import VerificationError
from bimvox.records.proof import Verification
from bimvox.records.reasons import NOT_PROVEN

T = TypeVar("T")

Refused = Mapping[str, str]
"""Ids of the components whose lifts are refused, with the reason."""

_ROUNDS = 12


def proven_in_rounds(attempt: Callable[[Refused], T | Refused], left: str) -> T:
    """Return the first result of an attempt that is proven.

    Args:
        attempt: Makes and proves all lifts except the refused ones; returns the result, or more lifts to refuse.
        left: What is not done if no result is found ("nothing was ..."), for the message.

    Raises:
        VerificationError: If lifts still fail after the last round.
    """
    refused: dict[str, str] = {}
    for _ in range(_ROUNDS):
        found = attempt(refused)
        if not isinstance(found, Mapping):
            return found
        last = next(iter(found.items()))
        if found.keys() <= refused.keys():
            break  # only lifts that are refused already: another round would give the same result
        refused |= found
    raise VerificationError(
        f"lifts still fail their proof, so nothing was {left}; the last one is {last[0]}: {last[1]}",
        failures=[f"{component}: {reason}" for component, reason in refused.items()],
        hint="try a finer [model] voxel_size_m, or other areas",
    )


def refusals(proof: Verification) -> dict[str, str]:
    """Return the lifts that fail a proof, each with the failed check.

    Raises:
        VerificationError: If the proof failed without naming a lift.
    """
    reasons: dict[str, str] = {}
    for check in proof.checks:
        for component in sorted(check.culprits):
            # Only the first failures are kept: none of them may be this lift's.
            failure = next((f": {f}" for f in check.failures if component in f), "")
            reasons.setdefault(component, f"{NOT_PROVEN}{check.name}{failure}")
    if not proof.verified and not reasons:
        raise VerificationError(
            f"the plan could not be proven, so it was not written: {proof.failures[0]}",
            failures=proof.failures,
            hint="this is a bug in bimvox; please report it with the site file",
        )
    return reasons
