"""The set-ups that no other beats, and why the others lost."""

from __future__ import annotations

from collections.abc import Sequence

from bimvox_pipeline.optimise.search import Tried


def front_of(found: Sequence[Tried]) -> list[Tried]:
    """Return the set-ups that no other beats: none serves as many parts in as little time at as little cost.

    Of equal ones the first; none over the budget. Fewer crane hours first; set-ups that serve fewer parts than the best
    are not among them.
    """
    within = [one for one in found if one.crane is not None and not one.over]
    most = max((one.served for one in within), default=0)
    able = [one for one in within if one.served == most and most]
    able.sort(key=lambda one: (one.crane_s, one.cost))
    front: list[Tried] = []
    for one in able:
        if all(one.cost < other.cost for other in front):
            front.append(one)
    return front


def spread(front: Sequence[Tried], most: int) -> list[Tried]:
    """Return at most so many of a front: the fastest, the cheapest, and others evenly between them."""
    if len(front) <= most:
        return list(front)
    if most == 1:
        return [front[0]]
    places = {round(n * (len(front) - 1) / (most - 1)) for n in range(most)}
    return [front[n] for n in sorted(places)]


def to_plan(found: Sequence[Tried], front: Sequence[Tried], most: int) -> list[Tried]:
    """Return at most so many set-ups to be planned in full.

    First those of the front, then the fastest of other machines, then others by their estimate. The estimate ranks; it
    does not decide between machines that are nearly as fast.
    """
    chosen = spread(front, most)
    if not chosen:
        return []
    able = [one for one in found if one.crane is not None and not one.over]
    others = [one for one in able if one.served == chosen[0].served and one not in chosen]
    others.sort(key=lambda one: one.crane_s)
    named = {one.machine for one in chosen}
    for one in others:
        if len(chosen) < most and one.machine not in named:
            chosen.append(one)
            named.add(one.machine)
    return [*chosen, *(one for one in others if one not in chosen)][:most]


def why_lost(one: Tried, front: Sequence[Tried]) -> str:
    """Return why a set-up is not of the front; empty if it is."""
    if one in front:
        return ""
    if one.over:
        return one.over
    if one.crane is None or not front or one.served < front[0].served:
        return one.why
    better = min(
        (other for other in front if other.crane_s <= one.crane_s and other.cost <= one.cost),
        key=lambda other: other.crane_s,
    )
    saved = one.cost - better.cost
    slower_h = (one.crane_s - better.crane_s) / 3600.0
    return f"{better.machine} with a jib of {better.jib_m:g} m takes {slower_h:.2f} h less and costs {saved:,.0f} less"
