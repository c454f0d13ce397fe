"""Two cranes instead of one: pairs of machines and places, and about how long they take together.

Each pair divides the parts as the plan does (:mod:`bimvox.site.assign`), and keeps the rules of the schedule but the
separation of the cranes (:mod:`bimvox.planning.order.makespan`): only where no angle of the other's jib leaves room, a
crane sets nothing. That a crane gives way to the other is the plan's to find, so the hours are too few.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations_with_replacement

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.machine import Machine
from bimvox.crane.outline import outline_of
from bimvox.crane.reach import distances_m
from bimvox.crane.tower_crane import TowerCrane
from bimvox.cranes.clock import clear_ways
from bimvox.errors import ConfigError
from bimvox.library.set_up_search.search import Search
from bimvox.library.set_up_search.set_up import Rig, Tried, ends, estimated_goals, front_of
from bimvox.library.set_up_search.timed import FEW_LIFTS, LIFTS
from bimvox.planning.order.makespan import NOTHING_APART, OrderTimes, makespan_s
from bimvox.site.assign import balanced, rough_work_s
from bimvox.site.checks import check_cranes
from bimvox.site.config.calendar import Rates
from bimvox.site.config.site_config import SiteConfig
from bimvox.site.set_ups import SetUps, highest_utilisation

_MOST_PLACES, _MOST_PARTS = 24, 120
"""Places of each rig, and parts, that the choice of pairs looks at."""
_MOST_NEAR = 200
_MOST_PAIRS = 12
"""Pairs that are looked at closely: so many of the fastest, and of the cheapest."""
_SLACK_M = 0.5
_NAMES = ("A", "B")


def may_pair(config: SiteConfig) -> bool:
    """Return whether a site may have two cranes: no load turns with the jib, and no part names its crane."""
    return config.rules.heading != "with_jib" and all(one.crane is None for one in config.component)


def names_of_two(given: str | None) -> tuple[str, str]:
    """Return the names of two cranes, the first of which has the name of the given one, if that has any."""
    first = given or _NAMES[0]
    return first, next(name for name in _NAMES if name != first)


def pairs(search: Search, machines: Sequence[Machine]) -> list[Tried]:
    """Return the fastest, the cheapest and the least used pair of those that serve most parts; at most three."""
    work = search.work.sample(_MOST_PARTS, len(search.work.yard_m))
    stands = []
    for rig in search.rigs(machines):
        bases_m = search.places_m(rig, _MOST_PLACES)
        if len(bases_m):
            stands.append(_Stand(rig, bases_m, search.served(rig, bases_m, work), search.rates(rig.machine)))
    share = len(search.work.masses_kg) / len(work.masses_kg)
    separation_m = search.config.rules_in_force.crane_separation_m
    chosen = _choice([_rough(a, b, separation_m, share) for a, b in combinations_with_replacement(stands, 2)])
    close = {n: tried for n, one in enumerate(chosen) if (tried := _close(search, one, separation_m, FEW_LIFTS))}
    front = front_of(list(close.values()))
    # Over the budget, one says so.
    best = ends(front, estimated_goals, lambda one: one.cranes) or sorted(close.values(), key=estimated_goals)[:1]
    again = [_close(search, chosen[n], separation_m, LIFTS) for n, one in close.items() if one in best]
    return [one for one in again if one is not None]


@dataclass(frozen=True, slots=True, eq=False)
class _Stand:
    """A rig on some places."""

    rig: Rig
    bases_m: NDArray[np.float64]
    found: SetUps
    rates: Rates


@dataclass(frozen=True, slots=True, eq=False)
class _Rough:
    """A pair of rigs on their best places, roughly."""

    rigs: tuple[Rig, Rig]
    bases_m: tuple[NDArray[np.float64], NDArray[np.float64]]
    missed: int
    hours: float
    cost: float


def _rough(a: _Stand, b: _Stand, separation_m: float, share: float) -> _Rough | None:
    """Return the best places of two rigs; None if none are far enough apart."""
    apart_m = distances_m(a.bases_m, b.bases_m)
    allowed = apart_m >= _least_apart_m(a.rig, b.rig, separation_m)
    if not allowed.any():
        return None
    missed, busy_s = _together(a.found, b.found)
    order = np.lexsort((busy_s.ravel(), missed.ravel(), ~allowed.ravel()))
    m, n = np.unravel_index(int(order[0]), busy_s.shape)
    hours = float(busy_s[m, n]) * share / 3600.0
    bases = (a.bases_m[m], b.bases_m[n])
    return _Rough((a.rig, b.rig), bases, int(missed[m, n]), hours, a.rates.with_another(b.rates).total(hours))


def _together(a: SetUps, b: SetUps) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return for each place of one crane and each of the other how many parts neither serves, and a time.

    The time of the busier crane, if what both serve is divided so that both work equally long.
    """
    by_a, by_b = a.served.astype(np.float64), b.served.astype(np.float64)
    alone_a, alone_b = a.lift_s @ (1.0 - by_b).T, (1.0 - by_a) @ b.lift_s.T
    both = (a.lift_s @ by_b.T + by_a @ b.lift_s.T) / 2.0
    missed = np.round((1.0 - by_a) @ (1.0 - by_b).T).astype(np.int64)
    return missed, np.maximum(np.maximum(alone_a, alone_b), (alone_a + alone_b + both) / 2.0)


def _choice(rough: Sequence[_Rough | None]) -> list[_Rough]:
    """Return the fastest and the cheapest pairs of those that miss fewest parts."""
    able = [one for one in rough if one is not None]
    fewest = min((one.missed for one in able), default=0)
    able = [one for one in able if one.missed == fewest]
    fast = sorted(able, key=lambda one: (one.hours, one.cost))[:_MOST_PAIRS]
    cheap = sorted(able, key=lambda one: (one.cost, one.hours))[:_MOST_PAIRS]
    return [*fast, *(one for one in cheap if one not in fast)]


def _close(search: Search, one: _Rough, separation_m: float, lifts: int) -> Tried | None:
    """Return a pair on the best places near its rough ones, its parts divided; None if the cranes would collide.

    Of each crane so many lifts are timed with the swing of loads.
    """
    bases_m = list(one.bases_m)
    for own, other in ((0, 1), (1, 0)):
        bases_m[own] = _moved(search, one, bases_m, (own, other), separation_m)
    cranes = _apart(search.config, one.rigs, bases_m, separation_m)
    if cranes is None:
        return None
    found = [_timed(search, rig, base_m, lifts) for rig, base_m in zip(one.rigs, bases_m, strict=True)]
    clear = clear_ways(cranes, search.work, separation_m)
    # The plan divides the parts by reach, wherever they lie in the yard; what does not lie within reach, it refuses.
    anywhere = replace(search.work, rooms=np.full_like(search.work.rooms, None))
    reached = [search.served(rig, base_m[None], anywhere) for rig, base_m in zip(one.rigs, bases_m, strict=True)]
    can = np.stack([each.served[0] for each in reached], axis=1) & clear
    reach_m = np.stack([distances_m(base_m[None], search.work.places_m)[0] for base_m in bases_m], axis=1)
    rough_s = [rough_work_s(rig.crane, reach_m[:, k], search.work.standing_s) for k, rig in enumerate(one.rigs)]
    whose = balanced(can, reach_m, np.stack(rough_s, axis=1))
    parts = []
    for k, (rig, base_m, crane) in enumerate(zip(one.rigs, bases_m, cranes, strict=True)):
        mine = (whose == k) & found[k].served[0] & clear[:, k]
        busy_s = float(found[k].lift_s[0][mine].sum())
        used = float(highest_utilisation(rig.whole_chart, base_m[None], search.work, mine[None])[0])
        places = (base_m[None], np.array([int(mine.sum())]), np.array([busy_s]))
        parts.append(Tried(*rig.names, crane, int(mine.sum()), busy_s, *places, "", 0.0, used))
    longest_s = _makespan_s(search, whose, np.stack([each.lift_s[0] for each in found]))
    first, second = (search.rates(rig.machine) for rig in one.rigs)
    cost = first.with_another(second).total(longest_s / 3600.0)
    served, total = sum(each.served for each in parts), len(search.work.masses_kg)
    return replace(
        parts[0], served=served, crane_s=longest_s, cost=cost, highest=max(each.highest for each in parts),
        over=search.over(cost), why="" if served == total else f"serve {served} of {total} parts", second=parts[1],
    )  # fmt: skip


def _timed(search: Search, rig: Rig, base_m: NDArray[np.float64], lifts: int) -> SetUps:
    """Return how a rig serves the parts from a base (2,), every way longer by what the swing of loads takes in all."""
    quick = search.served(rig, base_m[None])
    standing_s = quick.served * search.work.standing_s
    crane = replace(rig.crane, base_m=(*base_m.tolist(), 0.0))
    moving_s = search.timed_s(crane, quick.served[0], lifts) - float(standing_s.sum())
    longer = moving_s / max(float(quick.crane_s[0]) - float(standing_s.sum()), 1e-9)
    lift_s = standing_s + longer * (quick.lift_s - standing_s)
    return replace(quick, lift_s=lift_s, crane_s=lift_s.sum(axis=1))


def _makespan_s(search: Search, whose: NDArray[np.int64], lift_s: NDArray[np.float64]) -> float:
    """Return how long two cranes take for the parts in their sequence; those that neither serves take no time.

    ``whose``: (N,) the crane of each part; ``lift_s``: (2, N) crane time of each part.
    """
    count, work = len(whose), search.work
    own_s = np.take_along_axis(lift_s, whose[None], axis=0)[0]
    moving_s = np.maximum(own_s - work.standing_s, 0.0) / 2.0
    off_s = np.array([crew.brace_s + crew.hook_off_s for crew in search.crews])
    most_kg = search.config.rules.truckload_kg
    masses_kg = np.cumsum(work.masses_kg)
    times = OrderTimes(
        crane=whose.astype(np.int64),
        may=whose[:, None] == np.arange(2),
        delivery=(masses_kg // most_kg).astype(np.int64) if most_kg else np.zeros(count, np.int64),
        empty_s=np.tile(moving_s, (2, count, 1)),
        lead_s=np.where(own_s > 0.0, work.standing_s - off_s, 0.0),
        carry_s=np.tile(moving_s, (2, 1)),
        off_s=np.where(own_s > 0.0, off_s, 0.0),
        hold_s=np.zeros(count),
        work_s=np.zeros(count),
        crew=np.full(count, 2, np.int64),
        first=np.zeros(count + 1, np.int64),
        under=np.zeros(0, np.int64),
        apart=NOTHING_APART,
        beside=search.beside,
    )
    return makespan_s(times, range(count))


def _moved(
    search: Search,
    one: _Rough,
    bases_m: Sequence[NDArray[np.float64]],
    which: tuple[int, int],
    separation_m: float,
) -> NDArray[np.float64]:
    """Return the best place of one crane of a pair, while the other stays."""
    own, other = which
    rig, fixed = one.rigs[own], one.rigs[other]
    near_m = np.concatenate([bases_m[own][None], search.places_m(rig, _MOST_NEAR)])
    allowed = distances_m(near_m, bases_m[other][None])[:, 0] >= _least_apart_m(rig, fixed, separation_m)
    missed, busy_s = _together(search.served(rig, near_m), search.served(fixed, bases_m[other][None]))
    best: NDArray[np.float64] = near_m[int(np.lexsort((busy_s[:, 0], missed[:, 0], ~allowed))[0])]
    return best


def _least_apart_m(a: Rig, b: Rig, separation_m: float) -> float:
    """Return how far apart two masts must be: the jib of a hammerhead may pass above the other crane, if it is raised.

    See :func:`bimvox.site.checks.check_cranes`.
    """

    def reach_m(own: Rig, mast: Rig) -> float:
        solids, other = outline_of(own.usual), outline_of(mast.usual)
        out_m = max(solids.jib_end_m + solids.jib_half_m, solids.tail_m + solids.tail_half_m)
        return out_m + other.mast_half_m + separation_m + _SLACK_M

    ways = [reach_m(own, mast) for own, mast in ((a, b), (b, a)) if mast.usual.luffing is None]
    return min(ways, default=max(reach_m(a, b), reach_m(b, a)))


def _apart(
    config: SiteConfig, rigs: tuple[Rig, Rig], bases_m: Sequence[NDArray[np.float64]], separation_m: float
) -> tuple[TowerCrane, TowerCrane] | None:
    """Return the cranes, one of them on a higher mast if it must pass above the other; None if that is not enough."""
    a, b = (rig.on(base_m) for rig, base_m in zip(rigs, bases_m, strict=True))
    for raised in (None, 0, 1):
        cranes = [a, b]
        if raised is not None:
            if rigs[raised].usual.luffing is not None:
                continue
            own, other = outline_of(cranes[raised]), outline_of(cranes[1 - raised])
            lowest_m = min(own.jib_m[0], own.tail_height_m[0])
            higher_m = float(np.ceil(2.0 * (other.mast_height_m[1] + separation_m - lowest_m) + 1e-6)) / 2.0
            if higher_m <= 0.0:
                continue
            cranes[raised] = rigs[raised].on(bases_m[raised], higher_m)
        try:
            named = [replace(crane, name=name) for crane, name in zip(cranes, _NAMES, strict=True)]
            check_cranes(config, named, separation_m)
        except ConfigError:
            continue
        return cranes[0], cranes[1]
    return None
