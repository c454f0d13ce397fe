"""The last moves of a guided load: straight down, at rest at each pose, no faster than the crew guides it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from bimvox.motion.move import Move
from bimvox.records.guide import Guide


def guided(moves: Sequence[Move], guide: Guide) -> tuple[Move, ...]:
    """Return moves whose last one, straight down, rests at the height of every pose of a guide."""
    *before, last = moves
    place_m = last.end.height_m
    if last.start.height_m > place_m + guide.top_m:
        at = replace(last.end, height_m=place_m + guide.top_m)
        before.append(Move(last.start, at))
        last = Move(at, last.end)
    start = last.start
    for (height_m, _, _), least_s in zip(guide.poses[1:], guide.least_s, strict=True):
        end = replace(last.end, height_m=place_m + height_m)
        if end.height_m < start.height_m:
            before.append(Move(start, end, least_s=least_s))
            start = end
    return tuple(before)
