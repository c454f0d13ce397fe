"""Planning and proving in rounds: a lift that fails its proof gets another way; if none is proven, it is refused.

The rest is planned and proven again.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TypeVar

from bimvox.errors import NoPlanError, VerificationError
from bimvox.planning.insertion import Insertion
from bimvox.records.lift import HOOK_CANNOT_LEAVE, NOT_PROVEN, NOT_PROVEN_TOGETHER, Lift, Status
from bimvox.records.proof import Check, Verification
from bimvox.site.site import Site

T = TypeVar("T")

Refused = Mapping[str, str]
"""Ids of the components whose lifts are refused, with the reason."""

_ROUNDS = 12
_MOST_GROUPS = 24
"""Most groups of lifts that are tried if no lift can be named whose refusal helps."""
_MOST_OTHER_WAYS = 2
"""Most other ways that are tried for a lift ..."""
_MOST_OTHER_ROUNDS = 4
"""... and most rounds in which any are."""


class OtherWays:
    """The last moves that a proof refused: another way is tried before the lift is refused."""

    def __init__(self) -> None:
        self._ways: dict[str, tuple[Insertion, ...]] = {}
        self._reasons: dict[str, str] = {}
        self._unproven: dict[str, str] = {}
        self._rounds = 0

    def of(self, component: str) -> tuple[tuple[Insertion, ...], str | None]:
        """Return the last moves to avoid for a component, and why its first ones were refused; None if none were."""
        return self._ways.get(component, ()), self._reasons.get(component)

    def unproven(self, component: str) -> str | None:
        """Return why the path of a planner that the caller brought was refused for a component; None if it was not."""
        return self._unproven.get(component)

    def without(self, site: Site, made: Iterable[Lift], failed: Refused) -> dict[str, str]:
        """Return those of the lifts that failed for which no other way is tried; the others are noted.

        Args:
            site: The site.
            made: The lifts that can be made in another way.
            failed: The lifts that failed. What holds the hook fast is not theirs: no other way helps.
        """
        left, made = dict(failed), tuple(made)
        for lift in made:
            name = site.components[lift.component].id
            is_of_the_hook = failed.get(name, "").startswith(HOOK_CANNOT_LEAVE)
            if lift.planner is not None and name in left and not is_of_the_hook:  # first, the engine finds the path
                self._unproven[name] = f"{lift.planner}: its path was not proven: {left.pop(name)}"
        if not left:
            return left
        self._rounds += 1
        for lift in made if self._rounds <= _MOST_OTHER_ROUNDS else ():
            name = site.components[lift.component].id
            known = self._ways.get(name, ())
            if failed.get(name, "").startswith(HOOK_CANNOT_LEAVE) or name not in left:
                continue
            if lift.with_jib:
                self._ways.setdefault(name, ())  # first, its heading is kept
                self._reasons.setdefault(name, left.pop(name))
            elif lift.status is Status.PLANNED and len(known) < _MOST_OTHER_WAYS:
                self._ways[name] = (*known, Insertion(lift.last_moves_vox, guide=lift.guide))
                self._reasons.setdefault(name, left.pop(name))
                left.pop(name, None)
        return left


def proven_in_rounds(
    attempt: Callable[[Refused], T | Refused], left: str, lifts: Callable[[], Sequence[str]] = tuple
) -> T:
    """Return the first result of an attempt that is proven.

    If no lift can be named whose refusal helps, the lifts are proven in ever smaller groups; what fails even alone is
    refused. So one lift never takes the others with it.

    Args:
        attempt: Makes and proves all lifts except the refused ones; returns the result, or more lifts to refuse.
        left: What is not done if no result is found ("nothing was ..."), for the message.
        lifts: Returns the ids of the components whose lifts the last attempt made, in order. Without it, they are not
            proven in groups.

    Raises:
        VerificationError: If lifts still fail after the last round, and no group of them is proven.
    """
    refused: dict[str, str] = {}
    try:
        for _ in range(_ROUNDS):
            result = attempt(refused)
            if not isinstance(result, Mapping):
                return result
            last = next(iter(result.items()))
            if result.keys() <= refused.keys():
                break  # only lifts that are refused already: another round would give the same result
            refused |= result
        failed = VerificationError(
            f"lifts still fail their proof, so nothing was {left}; the last one is {last[0]}: {last[1]}",
            failures=[f"{component}: {reason}" for component, reason in refused.items()],
            hint="this is a bug in bimvox; please report it with the site file",
        )
    except VerificationError as error:
        failed = error
    proven = _proven_in_groups(attempt, refused, [name for name in lifts() if name not in refused])
    if proven is None:
        raise failed
    return proven


def _proven_in_groups(attempt: Callable[[Refused], T | Refused], refused: Refused, lifts: Sequence[str]) -> T | None:
    """Return a result in which as many of the lifts as possible are proven together; None if none is."""
    proven: T | None = None
    good: set[str] = set()
    groups = _halves(lifts)
    for _ in range(_MOST_GROUPS):
        if not groups:
            break
        group = groups.pop(0)
        aside = {name: NOT_PROVEN_TOGETHER for name in lifts if name not in good and name not in group}
        try:
            found = attempt({**refused, **aside})
        except (VerificationError, NoPlanError):
            found = {}
        if isinstance(found, Mapping):
            groups[:0] = _halves(group)
        else:
            proven, good = found, good.union(group)
    return proven


def _halves(group: Sequence[str]) -> list[Sequence[str]]:
    """Return the two halves of a group; nothing of a single lift, which is refused."""
    half = len(group) // 2
    return [group[:half], group[half:]] if half else []


def refusals(proof: Verification) -> dict[str, str]:
    """Return the lifts that fail a proof, each with the failed check.

    Raises VerificationError: if the proof failed without naming a lift.
    """
    reasons: dict[str, str] = {}
    for check in proof.checks:
        for component in sorted(check.culprits):
            failure = _failure_of(component, check)
            reasons.setdefault(component, f"{NOT_PROVEN}{check.name}{failure and f': {failure}'}")
    if not proof.verified and not reasons:
        raise VerificationError(
            f"the plan could not be proven, so it was not written: {proof.failures[0]}",
            failures=proof.failures,
            hint="this is a bug in bimvox; please report it with the site file",
        )
    return reasons


def _failure_of(component: str, check: Check) -> str:
    """Return the first kept failure of a lift; empty if none is. That of another lift may name its part as too near."""
    own = next((failure for failure in check.failures if _is_of(failure, component)), "")
    others = check.culprits - {component}
    of_none = (one for one in check.failures if component in one and not any(_is_of(one, name) for name in others))
    return own or next(of_none, "")


def _is_of(failure: str, component: str) -> bool:
    """Return whether a failure begins with a lift: by its id, or its number with name and id in brackets."""
    return failure.startswith(f"{component}:") or f"{component})" in failure
