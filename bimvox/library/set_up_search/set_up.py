"""What is tried (a machine, jib and reeving on a place, with a yard), and what no other of them beats."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.machine import Machine
from bimvox.crane.reach import standing
from bimvox.crane.tower_crane import TowerCrane
from bimvox.errors import enumerated
from bimvox.rendering.words import counted
from bimvox.site.config.site_config import Polygon
from bimvox.site.moving_guess import MovingCrane


@dataclass(frozen=True, slots=True)
class Effort:
    """How much is tried.

    Attributes:
        members: How many set-ups are planned in full.
        yards: How many other yards are tried.
        seconds: No other yard is begun after so many seconds; None: no limit.
        cranes: How many cranes a set-up has at most, 1 or 2.
    """

    members: int = 6
    yards: int = 48
    seconds: float | None = None
    cranes: int = 2


@dataclass(frozen=True, slots=True)
class OtherYard:
    """A yard, or a truckload, that is not the site file's.

    Attributes:
        number: Of its proposal, from 0; None: the site file's yard, with another truckload.
        polygon: The yard.
        truckload_kg: Largest mass of a delivery.
    """

    number: int | None
    polygon: Polygon
    truckload_kg: float


@dataclass(frozen=True, slots=True, eq=False)
class Tried:
    """A machine with one jib and reeving on all places.

    Attributes:
        machine: Its name.
        jib_m: Length of its jib.
        falls: Of its rope.
        load_moment_tm: Size of the machine.
        crane: The crane on the place in question; None if its mast has no place.
        served: Number of parts that it serves from there.
        crane_s: Estimated crane time from there, of those that serve most parts with the swing of loads.
        lifts: So many lifts were laid over time for it; 0: the quick estimate, or that times a factor of its machine.
        moving: The crane in its set-ups if it moves during the job: ``bases_m`` are their places, ``crane`` and
            ``jib_m`` those of the first.
        bases_m: (B, 2) all places.
        all_served: (B,) number of parts served from each.
        all_crane_s: (B,) crane time from each by the quick estimate, without swing.
        why: Why the first part that it does not serve is not served; empty if it serves all.
        cost: Estimated cost from there, in the currency of the site.
        highest: Estimated highest utilisation from there.
        over: Why its cost is refused; empty if it is within the budget.
        is_least_used: Whether the place is the one of the lowest utilisation, not the fastest.
        yard: The yard if it is not the site file's.
        place: Which of several places of the mast it is, from 2; 0: the best by the estimate.
        second: The other crane of two, on its place; the parts served, the time and the cost are those of both.
    """

    machine: str
    jib_m: float
    falls: int
    load_moment_tm: float
    crane: TowerCrane | None
    served: int
    crane_s: float
    bases_m: NDArray[np.float64]
    all_served: NDArray[np.int64]
    all_crane_s: NDArray[np.float64]
    why: str
    cost: float
    highest: float = 0.0
    over: str = ""
    is_least_used: bool = False
    yard: OtherYard | None = None
    place: int = 0
    second: Tried | None = None
    lifts: int = 0
    moving: MovingCrane | None = None

    @property
    def words(self) -> str:
        """The machine and its jib, or in how many set-ups it stands; of two cranes, both."""
        own = f"{self.machine} {_how(self.jib_m, 0 if self.moving is None else len(self.moving.cranes))}"
        return own if self.second is None else f"{own} and {self.second.words}"

    @property
    def cranes(self) -> int:
        """Number of cranes."""
        return 1 if self.second is None else 2

    @property
    def moves_s(self) -> float:
        """Estimated time from set-up to set-up, all moves together."""
        return 0.0 if self.moving is None else self.moving.moves_s


@dataclass(frozen=True, slots=True, eq=False)
class Rig:
    """A machine with one jib and reeving, on a mast as high as the site needs.

    Attributes:
        machine: The machine.
        jib_m: Length of its jib.
        usual: The crane with its usual rigging.
        crane: The crane as used: the permitted share of its chart, and the gear of the parts.
        hook_m: Height that its hook must reach.
    """

    machine: Machine
    jib_m: float
    usual: TowerCrane
    crane: TowerCrane
    hook_m: float

    @property
    def names(self) -> tuple[str, float, int, float]:
        """Name, jib, falls and load moment."""
        return self.machine.name, self.jib_m, self.usual.falls, self.machine.load_moment_tm

    @property
    def whole_chart(self) -> TowerCrane:
        """The crane as used, with its whole load chart."""
        return replace(self.crane, chart=self.usual.chart)

    def on(self, base_m: NDArray[np.float64], higher_m: float = 0.0) -> TowerCrane:
        """Return the crane on a base (2,), its mast higher by a length."""
        return replace(standing(self.usual, self.hook_m + higher_m), base_m=(*base_m.tolist(), 0.0))


_SHARE = 0.01
"""Utilisations that differ by less count as the same in an estimate."""

T = TypeVar("T")
Goals = tuple[float, float, float]
"""Hours, cost and highest utilisation; less is better."""


def front_of(found: Sequence[Tried]) -> list[Tried]:
    """Return the set-ups that no other beats, the cheapest first; none over the budget.

    Set-ups that serve fewer parts than the best are not among them.
    """
    within = [one for one in found if one.crane is not None and not one.over]
    most = max((one.served for one in within), default=0)
    return _unbeaten([one for one in within if one.served == most and most], estimated_goals)


def to_plan(found: Sequence[Tried], front: Sequence[Tried], most: int) -> list[Tried]:
    """Return at most so many set-ups to be planned in full.

    First :func:`ends` of the front, by how many cranes there are and whether one moves, then others of it up to half of
    ``most``, evenly from the cheapest on, then the cheapest of other machines, then others by their estimate. The
    estimate ranks; it does not decide between machines that are nearly as fast.
    """
    if not front:
        return []
    chosen = ends(front, estimated_goals, lambda one: (one.cranes, one.moving is None))[:most]
    left = [one for one in front if one not in chosen]
    room = max(0, most // 2 - len(chosen))
    chosen += left[:: max(1, -(-len(left) // room))][:room] if room else []
    able = [one for one in found if one.crane is not None and not one.over and one.cranes == 1]
    others = sorted(
        (one for one in able if one.served == front[0].served and one not in chosen),
        key=lambda one: (one.cost, one.crane_s),
    )
    named = {one.machine for one in chosen}
    for one in others:
        if len(chosen) < most and one.machine not in named:
            chosen.append(one)
            named.add(one.machine)
    return [*chosen, *(one for one in others if one not in chosen)][:most]


def ends(front: Sequence[Any], goals: Callable[[Any], Goals], group: Callable[[Any], Hashable]) -> list[Any]:
    """Return the cheapest, the fastest and the least used of a front, then the cheapest and the fastest by group.

    Each only once.
    """
    result: list[Any] = []
    if not front:
        return result

    def least(among: Sequence[Any], goal: int) -> Any:
        return min(among, key=lambda one: (goals(one)[goal], goals(one)))

    groups = [[one for one in front if group(one) == name] for name in dict.fromkeys(map(group, front))]
    every = [*(least(front, goal) for goal in (1, 0, 2)), *(least(among, goal) for goal in (1, 0) for among in groups)]
    for one in every:
        if one not in result:
            result.append(one)
    return result


def why_lost(one: Tried, front: Sequence[Tried]) -> str:
    """Return why a set-up is not of the front; empty if it is."""
    if one in front:
        return ""
    if one.over:
        return one.over
    if one.crane is None or not front or one.served < front[0].served:
        return one.why
    better = _better(estimated_goals(one), front, estimated_goals)
    return _said(better.words, estimated_goals(one), estimated_goals(better), 3600.0)


def proven_front(planned: Sequence[dict[str, Any]], budget: float | None) -> list[dict[str, Any]]:
    """Return the planned set-ups that no other beats, the cheapest first; those that refuse fewest parts alone.

    Args:
        planned: Documents of set-ups, see ``bimvox optimise --json``.
        budget: The most that one may cost; None: no limit.
    """
    able = [one for one in planned if one["hours"] is not None and (budget is None or one["cost"] <= budget)]
    fewest = min((one["refused"] for one in able), default=0)
    return _unbeaten([one for one in able if one["refused"] == fewest], planned_goals)


def why_beaten(one: dict[str, Any], front: Sequence[dict[str, Any]], budget: float | None) -> str:
    """Return why a planned set-up is not of the proven front."""
    if one["hours"] is None:
        return str(one["error"]["message"])
    if budget is not None and one["cost"] > budget:
        return "costs more than the budget"
    if one["refused"] > front[0]["refused"]:
        return f"infeasible lifts: {one['refused']}; of others {front[0]['refused']}"
    better = _better(planned_goals(one), front, planned_goals)
    both = [each for each in (better, better["second"]) if each]
    words = " and ".join(f"{each['machine']} {_how(each['jib_m'], len(each.get('set_ups') or ()))}" for each in both)
    return _said(words, planned_goals(one), planned_goals(better), 1.0)


def planned_goals(one: dict[str, Any]) -> Goals:
    """Return what is to be small of a planned set-up; without a utilisation, the whole capacity.

    A crane's moves from set-up to set-up are hours too. Two cranes count as fully used: a lower utilisation alone is
    not worth a second crane.
    """
    highest = one["highest_utilisation"]
    hours = one["hours"] + (one.get("move_hours") or 0.0)
    return hours, one["cost"], 1.0 if highest is None or one["second"] else highest


def estimated_goals(one: Tried) -> Goals:
    """Return what is to be small of a set-up, by its estimate; see :func:`planned_goals`."""
    return one.crane_s + one.moves_s, one.cost, 1.0 if one.second else round(one.highest / _SHARE) * _SHARE


def _how(jib_m: float, set_ups: int) -> str:
    return f"in {counted(set_ups, 'set-up')}" if set_ups else f"with a jib of {jib_m:g} m"


def _unbeaten(able: Sequence[T], goals: Callable[[T], Goals]) -> list[T]:
    """Return those that no other beats, by their goals, the cheapest first; of equal ones the first."""
    front: list[T] = []
    for one in sorted(able, key=goals):
        if not any(_beats(goals(other), goals(one)) for other in front):
            front.append(one)
    return sorted(front, key=lambda one: (goals(one)[1], goals(one)))


def _beats(one: Goals, other: Goals) -> bool:
    """Return whether nothing of one is worse than of another that comes after it."""
    return all(own <= their for own, their in zip(one, other, strict=True))


def _better(own: Goals, front: Sequence[T], goals: Callable[[T], Goals]) -> T:
    """Return the fastest of a front that beats something."""
    return min((other for other in front if _beats(goals(other), own)), key=goals)


def _said(who: str, own: Goals, better: Goals, hour: float) -> str:
    """Return by how much another is better."""
    slower_h, saved, points = (a - b for a, b in zip(own, better, strict=True))
    said = []
    if round(slower_h / hour, 2) > 0.0:
        said.append(f"takes {slower_h / hour:.2f} h less")
    if round(saved) > 0:
        said.append(f"costs {saved:,.0f} less")
    if round(100.0 * points) > 0 and own[2] < 1.0:
        said.append(f"uses {100.0 * points:.0f} points less of its capacity")
    return f"{who} {enumerated(said) or 'is as good'}"
