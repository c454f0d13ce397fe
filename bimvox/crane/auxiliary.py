"""The auxiliary hook of a crane: a second rope at the head of its boom."""

from __future__ import annotations

from dataclasses import dataclass, field

from bimvox.crane.load_chart import LoadChart
from bimvox.sparse import SPARSE


@dataclass(frozen=True, slots=True)
class Auxiliary:
    """What the second hook of a crane carries, and where it hangs.

    Attributes:
        chart: Its capacity over its own radius: load, slings and its hook block together.
        hook_block_kg: Mass of its hook block.
        ahead_m: How far its rope hangs ahead of that of the main hook, away from the slewing axis; negative behind.
        most_share: Share of the capacities that the maker permits while both hooks carry one load; None: not stated.
        fitted: Whether it hangs from the boom on this site. In the catalogue it does not.
    """

    chart: LoadChart
    hook_block_kg: float
    ahead_m: float
    most_share: float | None = None
    fitted: bool = field(default=False, compare=False, metadata=SPARSE)
