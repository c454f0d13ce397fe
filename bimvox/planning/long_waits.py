"""Where a delivery ends because the next part of the sequence waits long: for concrete that is cast, or for joints.

So does one where the crane moves to another set-up.

Dates are not known yet, so days are estimated as the programme counts them: work that the crane does not do takes hours
of shifts, concrete and joints cure through nights too, one crew does one part after the other, and lifts take no time
next to that.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from operator import itemgetter
from typing import Final

from bimvox.site.casting import curing_s, waits_for_joints, work_and_wait_s
from bimvox.site.means import Means
from bimvox.site.site import Site

LONGEST_DAYS: Final = 3.0
"""The waits between the first and the last lift of a delivery are no longer together (professional judgement)."""
_SHIFT_S: Final = 8 * 3600.0
_DAY_S: Final = 24 * 3600.0


def begin_days(site: Site, order: Sequence[int], waits_for: Sequence[Sequence[int]]) -> dict[int, float]:
    """Return on which day each part that a crane lifts is set, counted from the first one; it ascends with the order.

    Args:
        site: The site.
        order: All parts in the order of the sequence.
        waits_for: Per part, those that it waits for if they are earlier.
    """
    rules, found, carries = site.rules, dict[int, float](), dict[int, float]()
    free = dict.fromkeys(Means, 0.0)
    now = 0.0
    for number in order:
        part = site.components[number]
        waits = waits_for_joints(rules.curing, part)
        ready = max((carries[n] for n in waits_for[number] if n in carries and (waits or n not in found)), default=0.0)
        if part.means is Means.CRANE:
            if not found:  # what comes before the first lift is done by then
                carries, free, ready = dict.fromkeys(carries, 0.0), dict.fromkeys(Means, 0.0), 0.0
            now = found[number] = max(now, ready)
            carries[number] = now + curing_s(rules.curing, part) / _DAY_S
        else:
            work_s, wait_s = work_and_wait_s(rules.casting, rules.building, part, part.mass_kg)
            free[part.means] = max(ready, now, free[part.means]) + work_s / _SHIFT_S
            carries[number] = free[part.means] + wait_s / _DAY_S
    return found


def ends_by_waits(parts: Sequence[int], days: Mapping[int, float]) -> list[int]:
    """Return where a delivery ends at the latest that begins with each part, because the next one is set too late.

    ``parts``: what cranes lift, in the order of the lifts; ``days``: as of ``begin_days``, none for none.
    """
    ends, end = [], 0
    for first in parts:
        while end < len(parts) and days.get(parts[end], 0.0) <= days.get(first, 0.0) + LONGEST_DAYS:
            end += 1
        ends.append(end)
    return ends


def ends_by_moves(site: Site, parts: Sequence[int]) -> list[int]:
    """Return where a delivery ends at the latest that begins with each part, because the crane moves then.

    ``parts``: what a crane that moves lifts, in the order of the lifts.
    """
    ends: list[int] = []
    for n in reversed(range(len(parts))):
        goes_on = n + 1 < len(parts) and site.components[parts[n]].crane == site.components[parts[n + 1]].crane
        ends.append(ends[-1] if goes_on else n + 1)
    return ends[::-1]


def are_in_time(days: Mapping[int, float], deliveries: Mapping[int, int]) -> bool:
    """Return whether no delivery waits too long; ``deliveries``: the delivery of each part that has a place."""
    first: dict[int, float] = {}
    for part, day in sorted(days.items(), key=itemgetter(1)):
        if part in deliveries and day > first.setdefault(deliveries[part], day) + LONGEST_DAYS:
            return False
    return True
