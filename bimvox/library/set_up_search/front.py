"""The set-ups that no other beats, and why the others lost."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from bimvox.library.set_up_search.search import Tried


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


def proven_front(planned: Sequence[dict[str, Any]], budget: float | None) -> list[dict[str, Any]]:
    """Return the planned set-ups that no other beats: none refuses as few parts in as little time at as little cost.

    Those that refuse fewest parts alone; fewer hours first.

    Args:
        planned: Documents of set-ups, see ``bimvox optimise --json``.
        budget: The most that one may cost; None: no limit.
    """
    able = [one for one in planned if one["hours"] is not None and (budget is None or one["cost"] <= budget)]
    fewest = min((one["refused"] for one in able), default=0)
    able = sorted((one for one in able if one["refused"] == fewest), key=lambda one: (one["hours"], one["cost"]))
    front: list[dict[str, Any]] = []
    for one in able:
        if all(one["cost"] < other["cost"] for other in front):
            front.append(one)
    return front


def why_beaten(one: dict[str, Any], front: Sequence[dict[str, Any]], budget: float | None) -> str:
    """Return why a planned set-up is not of the proven front."""
    if one["hours"] is None:
        return str(one["error"]["message"])
    if budget is not None and one["cost"] > budget:
        return "costs more than the budget"
    if one["refused"] > front[0]["refused"]:
        return f"refuses {one['refused']} parts, others {front[0]['refused']}"
    able = [other for other in front if other["hours"] <= one["hours"] and other["cost"] <= one["cost"]]
    better = min(able, key=lambda other: (other["hours"], other["cost"]))
    slower_h, saved = one["hours"] - better["hours"], one["cost"] - better["cost"]
    who = f"{better['machine']} with a jib of {better['jib_m']:g} m"
    return f"{who} takes {slower_h:.2f} h less and costs {saved:,.0f} less"
