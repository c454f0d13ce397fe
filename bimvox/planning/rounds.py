"""Making and proving in rounds: what fails its proof is refused, and the rest is made and proven again."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TypeVar

from bimvox.errors import VerificationError
from bimvox.records.proof import Verification

T = TypeVar("T")

Refused = Mapping[str, str]
"""Ids of the components whose lifts are refused, and why."""

_ROUNDS = 12


def proven_in_rounds(attempt: Callable[[Refused], T | Refused], left: str) -> T:
    """Return what an attempt made and proved.

    Args:
        attempt: Makes all lifts but those that are refused and proves them; returns the result, or which of them to
            refuse as well.
        left: What becomes of the result where none is found, for the message.

    Raises:
        VerificationError: If there is no end of lifts that fail.
    """
    refused: dict[str, str] = {}
    for _ in range(_ROUNDS):
        found = attempt(refused)
        if not isinstance(found, Mapping):
            return found
        last = next(iter(found.items()))
        if found.keys() <= refused.keys():
            break  # what is refused already, and made all the same: no further round is another one
        refused |= found
    raise VerificationError(
        f"lifts fail their proof again and again, so nothing was {left}; the last one {last[0]}: {last[1]}",
        failures=[f"{component}: {reason}" for component, reason in refused.items()],
        hint="a finer [model] voxel_size_m, or other areas, may help",
    )


def refusals(proof: Verification) -> dict[str, str]:
    """Return the lifts that a proof failed about, with what failed.

    Raises:
        VerificationError: If it failed about none of them.
    """
    reasons: dict[str, str] = {}
    for check in proof.checks:
        for component in sorted(check.culprits):
            said = next((f for f in check.failures if component in f), check.failures[0])
            reasons.setdefault(component, f"its lift could not be proven ({check.name}: {said})")
    if not proof.verified and not reasons:
        raise VerificationError(
            f"the plan was not proven, so it was not written: {proof.failures[0]}",
            failures=proof.failures,
            hint="this is a fault of bimvox; please report it with the site file",
        )
    return reasons
