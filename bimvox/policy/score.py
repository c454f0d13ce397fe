"""The score of anyone's policy on the frozen held-out suite: alone, and under the loop guard."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from bimvox.env.guard import Guard
from bimvox.env.observation import VIEW_NAME
from bimvox.env.problem import LiftProblem, lift_problem
from bimvox.errors import InputError
from bimvox.planning.rollout import (
    PLAN_LIMIT,
    Rollout,
    TowardsTarget,
    Values,
    roll_out_all,
    roll_out_starts,
)
from bimvox.policy.callables import checked
from bimvox.policy.generalist.suite import ProblemSet, digest_of, frozen_problem, problem_sets, set_digest
from bimvox.policy.train import success_at_least
from bimvox.progress import Progress
from bimvox.site.config.validation import Table, Text, Whole

# The result of ``bimvox policy score``; ``bimvox schema score`` prints its schema.

_Count = Annotated[Whole, Field(ge=0)]
_Share = Annotated[float, Field(ge=0.0, le=1.0)]
_Ratio = Annotated[float, Field(ge=0.0)]
_Sha256 = Annotated[str, Field(pattern="^[0-9a-f]{64}$")]


class WayScore(Table):
    """How a policy did in one way."""

    arrived: _Count
    """Problems on which it reached the target."""
    success: _Share
    """Their share."""
    interval: tuple[_Share, _Share]
    """Exact two-sided 95 % interval of that share (Clopper and Pearson)."""
    moves_per_shortest: _Ratio | None
    """Mean of path moves (loops cut) / fewest moves, over those that arrived; null if none did."""
    made_per_shortest: _Ratio
    """Mean of moves made, in all tries, / fewest moves, over all problems."""


class SetScore(Table):
    """How a policy did on one set of problems."""

    set: Text
    """Name of the set."""
    problems: Annotated[Whole, Field(ge=1)]
    """How many of them, from the first on."""
    digest: _Sha256
    """SHA-256 of their digests, one a line: equal digests, equal problems."""
    alone: WayScore
    """By the free move of the highest value."""
    guarded: WayScore
    """Under the loop guard: up to four tries, one way."""


class PolicyScore(Table):
    """The score of a policy on the frozen held-out problems."""

    policy: Text
    """Id, ``greedy``, the beginning of the file's SHA-256, or ``module:function``."""
    format: Literal["bimvox-policy-score"]
    """Name of this format."""
    version: Literal[1]
    """Version of this format."""
    observation: Text
    """Name of what the policy observes."""
    share: Annotated[float, Field(gt=0.0, le=1.0)]
    """Share of each set, from its first problem on."""
    sets: Annotated[tuple[SetScore, ...], Field(min_length=1)]
    """Scores by set."""


_NO_GUARD = Guard(factor=0.0, slack=-1, reach_vox=-2, cost=0.0, visit_cost=0.0)
"""The free move of the highest value, whatever was visited before."""

WITHOUT_A_WAY = "unsolvable"
"""The set in which nobody can arrive; it is not scored."""

_AT_ONCE = 8
"""Problems in memory together; the largest take 100 MB each."""


@dataclass(frozen=True, slots=True)
class _Tried:
    """One problem tried in one way.

    Attributes:
        moves: Moves of the path with its loops cut; None if it did not arrive.
        made: Moves made.
        shortest: Fewest moves possible.
    """

    moves: int | None
    made: int
    shortest: int


def chosen_sets(names: Sequence[str]) -> list[ProblemSet]:
    """Return sets of the suite by name, without names all that can be scored.

    Raises:
        InputError: There is no such set.
    """
    known = {name: one for name, one in problem_sets().items() if name != WITHOUT_A_WAY}
    for name in names:
        if name not in known:
            raise InputError(f"--set {name}: there is no such set to score", hint=f"one of {', '.join(known)}")
    return [known[name] for name in dict.fromkeys(names)] or list(known.values())


def score(
    policy: str, values: Values | TowardsTarget, sets: Sequence[ProblemSet], share: float, progress: Progress
) -> PolicyScore:
    """Return the score of a policy.

    Args:
        policy: What names it in the result.
        values: The policy, or greedy values.
        sets: What it is scored on.
        share: Of each set, from its first problem on.
        progress: Counts the problems.

    Raises:
        PolicyError: The policy fails, or a problem is not the frozen one.
    """
    asked = values if isinstance(values, TowardsTarget) else checked(values)
    found = [_of_set(asked, one, max(1, round(one.count * share)), progress) for one in sets]
    return PolicyScore(
        policy=policy,
        format="bimvox-policy-score",
        version=1,
        observation=VIEW_NAME,
        share=share,
        sets=tuple(found),
    )


def _of_set(values: Values | TowardsTarget, one: ProblemSet, count: int, progress: Progress) -> SetScore:
    digests: list[str] = []
    alone: list[_Tried] = []
    guarded: list[_Tried] = []
    with progress.stage(f"scoring {one.name}", count):
        for first in range(0, count, _AT_ONCE):
            problems = [frozen_problem(one, number) for number in range(first, min(count, first + _AT_ONCE))]
            digests += map(digest_of, problems)
            shortest = [problem.distance_from(problem.start_vox) for problem in problems]
            lifts = [lift_problem(problem.space, problem.start_vox, problem.target_vox) for problem in problems]
            alone += map(_tried, _without_guard(values, lifts), shortest)
            guarded += map(_tried, roll_out_all(values, lifts, from_target=False), shortest)
            progress.advance(len(problems))
    return SetScore(
        set=one.name,
        problems=count,
        digest=set_digest(digests),
        alone=_summary(alone),
        guarded=_summary(guarded),
    )


def _without_guard(values: Values | TowardsTarget, lifts: Sequence[LiftProblem]) -> Sequence[Rollout]:
    starts = np.array([lift.start_vox for lift in lifts], np.int32)
    return roll_out_starts(values, lifts, np.arange(len(lifts)), starts, limit=PLAN_LIMIT, guard=_NO_GUARD)


def _tried(rollout: Rollout, shortest: int) -> _Tried:
    return _Tried(len(rollout.path_vox) - 1 if rollout.arrived else None, rollout.steps, shortest)


def _summary(tried: Sequence[_Tried]) -> WayScore:
    ratios = [one.moves / one.shortest for one in tried if one.moves is not None]
    count, arrived = len(tried), len(ratios)
    return WayScore(
        arrived=arrived,
        success=arrived / count,
        interval=(success_at_least(arrived, count, 0.975), 1.0 - success_at_least(count - arrived, count, 0.975)),
        moves_per_shortest=float(np.mean(ratios)) if ratios else None,
        made_per_shortest=float(np.mean([one.made / one.shortest for one in tried])),
    )
