"""The result of ``bimvox policy score``; ``bimvox schema score`` prints its schema."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from bimvox.site.config.validation import Table, Text, Whole

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
