"""The estimated makespan of an erection sequence with given places in the yard, one crane or several apart.

An empty hook goes as fast as slewing and trolley can from the part before to the next one. A carry takes the crew's
times and ``_OVER`` times what the slowest axis needs over everything of its stage. Several cranes keep the rules R1 to
R5 of ``cranes.schedule``, R4 as in ``apart``. Work that the crane does not do, and joints that cure, hold up what rests
on them, as in ``motion.steps``.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel, leaf_kernel
from bimvox.crane.conflict import (
    COLUMNS,
    HOOK_HIGH,
    HOOK_LOW,
    LOAD_HALF,
    LOWEST,
    RADIUS_HIGH,
    RADIUS_LOW,
    ROPE_HALF,
    SLEW_HIGH,
    SLEW_LOW,
    meet,
    numbers_of,
)
from bimvox.crane.kinematics import Axes, hoist_limits
from bimvox.crane.outline import outline_of
from bimvox.crane.travel import Travel
from bimvox.planning.stage import could_lift
from bimvox.records.lift import YardPlace
from bimvox.site.casting import curing_s, waits_for_joints, work_and_wait_s
from bimvox.site.crew_times import TRIAL_LIFT_S, crew_times, standing_s, upending_s
from bimvox.site.lifting import crane_for
from bimvox.site.means import Means
from bimvox.site.site import Site, floors_at_feet, parts_beside

# The separation of several cranes as the estimate of an order sees it (rule R4 of ``cranes.schedule``).
#
# While slings are taken off one part, another crane picks the next one and brings it. Both stay apart if it meets the
# first crane, which stands over the part that it has set, at no time of its lift. Otherwise it has to wait until the
# first crane has left. The solids are those of the schedule; the lift goes straight up, across and down.

_ACROSS = 7
_STEPS = _ACROSS + 3
"""Steps of a lift: hooking on, up, across, down."""
_SWING_M = 0.2
_LEAVES_S = 20.0
"""How long a crane needs to make room after the slings of its part are off."""


class Apart(NamedTuple):
    """What decides whether cranes come too near each other.

    Attributes:
        outlines: (K, 15) the cranes.
        stands: (K, N, 9) each crane over the place of each part; columns as in ``crane.meeting``.
        ways: (K, N, S, 9) each step of a lift.
        begins_s: (K, N, S) when it begins, from hooking on.
        separation_m: The distance that they keep.
        meets_s: (K, K - 1, N, N) float32 when the lift of part j by another crane than a first meets crane a over part
            i; infinite if it never does, NaN if nobody has asked yet. Most pairs never are next to each other.
    """

    outlines: NDArray[np.float64]
    stands: NDArray[np.float64]
    ways: NDArray[np.float64]
    begins_s: NDArray[np.float64]
    separation_m: float
    meets_s: NDArray[np.float32]


NOTHING_APART = Apart(
    np.zeros((0, 15)), np.zeros((0, 0, COLUMNS)), np.zeros((0, 0, 0, COLUMNS)), np.zeros((0, 0, 0)), 0.0,
    np.zeros((0, 0, 0, 0), np.float32),
)  # fmt: skip
"""Of cranes that nobody keeps apart."""


def _apart_of(
    site: Site, axes: Sequence[tuple[Axes, Axes]], over_m: NDArray[np.float64], spans_s: NDArray[np.float64]
) -> Apart:
    """Return what keeps the cranes of a site apart; for one crane without parts.

    ``axes``: per crane the hook's axes at the places of all parts, and at the picks; ``over_m``: (N,) how high the hook
    must go on the way; ``spans_s``: (K, 4, N) how long hooking on, up, across and down take.
    """
    cranes, count = len(site.cranes), len(site.components) if site.has_several_cranes else 0
    stands, ways = np.zeros((cranes, count, COLUMNS)), np.zeros((cranes, count, _STEPS, COLUMNS))
    begins_s = np.zeros((cranes, count, _STEPS))
    for k in range(cranes) if count else ():
        stands[k], ways[k] = _rows(site, k, axes[k], over_m)
        on_s, up_s, across_s, _ = spans_s[k]
        begins_s[k, :, 1:] = on_s[:, None]
        begins_s[k, :, 2:] += up_s[:, None] + across_s[:, None] * np.arange(_ACROSS + 1) / _ACROSS
    outlines = np.array([numbers_of(outline_of(crane)) for crane in site.cranes])
    meets_s = np.full((cranes, cranes - 1, count, count), np.nan, np.float32)
    return Apart(outlines, stands, ways, begins_s, site.rules.crane_separation_m, meets_s)


def _rows(
    site: Site, number: int, axes: tuple[Axes, Axes], over_m: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return (N, 9) a crane over the places of parts, and (N, S, 9) the steps of their lifts."""
    (slew, radius, at_m), (pick_slew, pick_radius, pick_m) = axes
    parts, cell_m = site.components, site.frame.voxel_size_m
    size_m = cell_m * np.array([part.shape.size_vox for part in parts])
    sling_m = np.array([crane_for(site, site.cranes[number], part).sling_m for part in parts])
    hook_m = cell_m * (np.array([part.hook_line_vox[:2] for part in parts]) + 0.5)
    half_m = np.hypot(*np.maximum(hook_m, size_m[:, :2] - hook_m).T)
    top_m = np.maximum(over_m, np.maximum(at_m, pick_m))
    turn = np.remainder(slew - pick_slew + np.pi, 2.0 * np.pi) - np.pi
    rows = np.zeros((len(parts), _STEPS + 1, COLUMNS))  # the last one is over its place
    for step in range(_STEPS + 1):
        ends = [min(max(step - 2 + more, 0), _ACROSS) / _ACROSS for more in (0, 1)] if step > 1 else [0.0, 0.0]
        slews = np.stack([pick_slew + turn * end for end in ends])
        radii = np.stack([pick_radius + (radius - pick_radius) * end for end in ends])
        low_m = pick_m if step < 2 else at_m if step >= _STEPS - 1 else top_m
        rows[:, step, SLEW_LOW], rows[:, step, SLEW_HIGH] = slews.min(axis=0), slews.max(axis=0)
        rows[:, step, RADIUS_LOW], rows[:, step, RADIUS_HIGH] = radii.min(axis=0), radii.max(axis=0)
        rows[:, step, HOOK_LOW] = sling_m + low_m
        rows[:, step, HOOK_HIGH] = sling_m + (top_m if 0 < step < _STEPS else low_m)
        rows[:, step, LOWEST] = low_m - size_m[:, 2]
        rows[:, step, LOAD_HALF] = np.hypot(half_m, size_m[:, 2]) if step == 0 else half_m  # upended
        rows[:, step, ROPE_HALF] = _SWING_M
    return rows[:, _STEPS].copy(), rows[:, :_STEPS].copy()


@kernel
def waits_s(apart: Apart, one: tuple[int, int], other: tuple[int, int]) -> float:
    """Return how much later than the slings of a part are off the lift of another part may begin, by another crane.

    Args:
        apart: What keeps them apart.
        one: The crane that has set a part, and the part.
        other: The crane that lifts another part, and that part.
    """
    a, i = one
    b, j = other
    if apart.meets_s.size == 0:
        return -np.inf
    which = b - 1 if b > a else b
    meets_s = apart.meets_s[a, which, i, j]
    if np.isnan(meets_s):
        meets_s = np.inf
        for step in range(_STEPS):
            way = apart.ways[b, j, step]
            if meet(apart.outlines[a], apart.stands[a, i], apart.outlines[b], way, apart.separation_m):
                meets_s = apart.begins_s[b, j, step]
                break
        apart.meets_s[a, which, i, j] = meets_s
    return float(_LEAVES_S - meets_s)


# The preference for the next part on a site with several cranes.
#
# Parts are set one after the other in the plan's order, whichever crane carries them, so the order balances the cranes:
# next is the crane that has worked least so far, and of its parts the one that it reaches fastest.

_ROWS = 64
"""So many parts are paired with all at once: thousands with thousands would fill the memory many times over."""


class Shared:
    """Chooses the next part on a site with several cranes.

    Args:
        site: The site.
        travel_axes: Per crane the hook's axes at the targets and at the picks of all parts, and its travel times.
    """

    def __init__(self, site: Site, travel_axes: Sequence[tuple[Axes, Axes, Travel]]) -> None:
        self._crane = np.array([component.crane for component in site.components])
        self._assembly = [component.hints.assembly for component in site.components]
        self._empty_s: list[NDArray[np.float32]] = []
        self._loaded_s: list[NDArray[np.float64]] = []
        for targets, picks, travel in travel_axes:
            self._empty_s.append(whole_seconds(travel, targets, picks))
            self._loaded_s.append(travel.between_s(picks, targets))
        self._crew_s = [
            standing_s(site.rules, one, upended=one.erected, flipped=one.flip_rise_vox > 0) for one in site.components
        ]
        self._worked_s = np.zeros(len(travel_axes))
        self._last: dict[int, int] = {}
        self._counted = 0

    def __call__(self, ready: list[int], order: list[int]) -> int:
        """Return the next part."""
        self._count(order)
        if order and self._assembly[order[-1]] is not None:
            ready = [i for i in ready if self._assembly[i] == self._assembly[order[-1]]] or ready
        numbers = np.array(ready)
        owners = self._crane[numbers]
        least = min(set(owners.tolist()), key=lambda k: (round(float(self._worked_s[k]), 3), k))
        numbers = numbers[owners == least]
        last = self._last.get(least)
        if last is None:
            return int(numbers[0])
        return int(numbers[np.argmin(self._empty_s[least][last, numbers])])

    def _count(self, order: list[int]) -> None:
        for i in order[self._counted :]:
            k = int(self._crane[i])
            empty_s = float(self._empty_s[k][self._last[k], i]) if k in self._last else 0.0
            self._worked_s[k] += self._crew_s[i] + empty_s + float(self._loaded_s[k][i])
            self._last[k] = i
        self._counted = len(order)


def at(axes: Axes, numbers: Any) -> Axes:
    """Return hook axes indexed by numbers of parts."""
    return axes[0][numbers], axes[1][numbers], axes[2][numbers]


def pairs(start: Axes, end: Axes) -> Iterator[tuple[slice, Axes, Axes]]:
    """Yield all pairs of N and M hook axes, some rows at a time: which rows, and both to be broadcast to (rows, M)."""
    for first in range(0, len(start[0]), _ROWS):
        rows = slice(first, first + _ROWS)
        yield rows, at(at(start, rows), (slice(None), None)), at(end, (None, slice(None)))


def whole_seconds(travel: Travel, start: Axes, end: Axes) -> NDArray[np.float32]:
    """Return (N, M) travel times between N and M hook axes in whole seconds, so that rounding noise decides nothing."""
    seconds = np.empty((len(start[0]), len(end[0])), np.float32)
    for rows, some, all_ in pairs(start, end):
        seconds[rows] = np.round(travel.between_s(some, all_))
    return seconds


Places = tuple[YardPlace | None, ...]
_OVER = 2.0
"""Timed loaded motions take 1.8 to 2.5 times the slowest axis over the parts below, on seven models."""
_CREW_OF = {Means.IN_SITU: 0, Means.BY_HAND: 1, Means.BUILT: 2, Means.CRANE: 3}
NOTHING_BESIDE = np.zeros((0, 0), np.bool_)
"""Of one crane."""
_SAME_S = 1e-6
_RAISED, _RELEASED, _EARLIER, _DELIVERY, _CREWS, _SET, _BEGUN, STATE_COLUMNS = 0, 1, 2, 3, 4, 7, 8, 9
"""Columns of a state, after each crane's free time and last part: when the last part was raised, when the slings of all
were off, the same of earlier deliveries, the delivery, when each of three crews is free, when all parts were at their
places, whether a lift has begun."""


class OrderTimes(NamedTuple):
    """What the parts of a site take, by component.

    Attributes:
        crane: (N,) int64 its crane; -1 if no crane lifts it.
        may: (N, K) which cranes may lift it.
        delivery: (N,) int64.
        empty_s: (K, N, N) by each crane, from the place of one part to the pick of another one that it may lift.
        lead_s: (N,) from hooking on until it is raised.
        carry_s: (K, N) from there until it is at its place, by each crane that may lift it.
        off_s: (N,) from there until the slings are off.
        hold_s: (N,) from there until it carries what rests on it; of other work after it has ended.
        work_s: (N,) how long other work takes.
        crew: (N,) int64 who does that: 0 casts, 1 sets by hand, 2 builds, 3 nobody that is known.
        first: (N + 1,) int64 where those that it rests on begin in ``under``.
        under: (M,) int64; floors at the feet of a part, too, which hold it up only if they come earlier.
        apart: What keeps several cranes apart.
        beside: (N, N) which parts stand next to each other, of several cranes.
    """

    crane: NDArray[np.int64]
    may: NDArray[np.bool_]
    delivery: NDArray[np.int64]
    empty_s: NDArray[np.float64]
    lead_s: NDArray[np.float64]
    carry_s: NDArray[np.float64]
    off_s: NDArray[np.float64]
    hold_s: NDArray[np.float64]
    work_s: NDArray[np.float64]
    crew: NDArray[np.int64]
    first: NDArray[np.int64]
    under: NDArray[np.int64]
    apart: Apart
    beside: NDArray[np.bool_]


class Course(NamedTuple):
    """An order carried out.

    Attributes:
        states: (N + 1, S) the state before each part of the order, and behind the last one.
        carried_s: (N,) when each part carried.
        rank: (N,) int64 position of each part in the order.
    """

    states: NDArray[np.float64]
    carried_s: NDArray[np.float64]
    rank: NDArray[np.int64]


def order_times(
    site: Site,
    travels: Sequence[Travel],
    places: Places,
    over_m: NDArray[np.float64],
    supports: Sequence[Sequence[int]],
    free: NDArray[np.bool_],
) -> OrderTimes:
    """Return what the parts of a site take if they are picked at these places.

    Args:
        site: The site.
        travels: The travel times of its cranes.
        places: The places.
        over_m: (N,) how high the hook must go on the way.
        supports: Per component those that it rests on.
        free: (N,) which components another crane may lift.
    """
    parts, rules = site.components, site.rules
    cranes, count = len(travels), len(parts)
    lifted = np.array([place is not None for place in places])
    crane = np.where(lifted, [part.crane for part in parts], -1)
    may = crane[:, None] == np.arange(cranes)
    for n, place in enumerate(places) if cranes > 1 else ():
        if free[n] and place is not None:
            may[n] = [k == crane[n] or could_lift(site, parts[n], place, k) for k in range(cranes)]
    empty_s, lead_s = np.zeros((cranes, count, count)), np.zeros(count)
    spans_s, axes = np.zeros((cranes, 4, count)), []
    for k, travel in enumerate(travels):
        targets, picks = target_axes(site, travel), pick_axes(site, travel, places)
        axes.append((targets, picks))
        own = np.flatnonzero(may[:, k])
        for rows, there, to in pairs(targets, at(picks, own)):
            empty_s[k][rows, own] = travel.across_s(to[0] - there[0], to[1] - there[1])
        across_s = travel.across_s(targets[0] - picks[0], targets[1] - picks[1])
        for i in own:
            winch = travel.with_hoist(hoist_limits(site.cranes[k], parts[i].mass_kg))
            ups_m = np.maximum(0.0, over_m[i] - np.array([picks[2][i], targets[2][i]]))
            up_s, down_s = winch.hoisting_s(ups_m).tolist()
            spans_s[k, 1:, i] = up_s, across_s[i], down_s
    carry_s = _OVER * np.maximum(spans_s[:, 2], spans_s[:, 1] + spans_s[:, 3])
    crew = [crew_times(rules, part) for part in parts]
    works = [work_and_wait_s(rules.casting, rules.building, part, part.mass_kg) for part in parts]
    upend_s = np.array([upending_s(rules, upended=one.erected, flipped=one.flip_rise_vox > 0) for one in parts])
    lead_s[lifted] = (upend_s + [one.hook_on_s + TRIAL_LIFT_S for one in crew])[lifted]
    hold_s = np.where(lifted, [curing_s(rules.curing, part) for part in parts], [wait_s for _, wait_s in works])
    # What carries at once holds nothing up.
    waits, floors = [waits_for_joints(rules.curing, part) for part in parts], floors_at_feet(site)
    under = [
        [j for j in own if not lifted[j] or (hold_s[j] > 0.0 and waits[n])]
        + np.flatnonzero(floors[n] & lifted).tolist()
        for n, own in enumerate(supports)
    ]
    spans_s[:, 1:] *= (carry_s / np.maximum(spans_s[:, 1:].sum(axis=1), 1e-9))[:, None]
    spans_s[:, 0] = lead_s
    return OrderTimes(
        crane.astype(np.int64),
        may,
        np.array([-1 if place is None else place.delivery for place in places], np.int64),
        empty_s,
        lead_s,
        carry_s,
        np.where(lifted, [one.brace_s + one.hook_off_s for one in crew], 0.0),
        hold_s,
        np.array([work_s for work_s, _ in works]),
        np.array([_CREW_OF[part.means] for part in parts], np.int64),
        np.concatenate([[0], np.cumsum([len(own) for own in under])]).astype(np.int64),
        np.array([j for own in under for j in own], np.int64),
        _apart_of(site, axes, over_m, spans_s),
        parts_beside(site) if cranes > 1 else NOTHING_BESIDE,
    )


def target_axes(site: Site, travel: Travel) -> Axes:
    """Return the hook's axes at the places of all parts in the building."""
    return _axes(site, travel, [tuple(np.add(c.target_vox, c.hook_line_vox)) for c in site.components])


def pick_axes(site: Site, travel: Travel, places: Places) -> Axes:
    """Return the hook's axes at the picks; for a part without a place in the yard, at its target."""
    cells = []
    for component, place in zip(site.components, places, strict=True):
        cell = np.add(component.target_vox, component.hook_line_vox)
        if place is not None:
            cell = np.add(place.transit_start_vox, component.hook_line_vox)
            cell[2] = place.cell_vox[2] + place.shape.size_vox[2]
        cells.append(tuple(cell))
    return _axes(site, travel, cells)


def _axes(site: Site, travel: Travel, cells: list[tuple[float, ...]]) -> Axes:
    at_m = np.array(site.frame.origin_m) + site.frame.voxel_size_m * (np.array(cells) + np.array([0.5, 0.5, 0.0]))
    return travel.axes_of(at_m)


def makespan_s(times: OrderTimes, order: Sequence[int]) -> float:
    """Return the estimated time from the first lift of an order until the slings of the last one are off, seconds."""
    cranes = times.may.shape[1]
    numbers = np.array(order, np.int64)
    done = course_of(len(order), cranes)
    walk(times, times.crane, numbers, (0, len(order)), done, done)
    return float(done.states[-1, 2 * cranes + _RELEASED])


def course_of(count: int, cranes: int) -> Course:
    """Return room for the course of an order of so many parts, with the state before all of them."""
    states = np.zeros((count + 1, 2 * cranes + STATE_COLUMNS))
    states[0, cranes : 2 * cranes] = -1.0
    states[0, 2 * cranes + _DELIVERY] = -1.0
    return Course(states, np.zeros(count), np.arange(count))


@kernel
def walk(
    times: OrderTimes,
    crane: NDArray[np.int64],
    order: NDArray[np.int64],
    window: tuple[int, int],
    was: Course,
    new: Course,
) -> int:
    """Carry out an order from the first position of a window on; write the states and the times of the new course.

    Args:
        times: The times.
        crane: (N,) the crane of each part; -1 if none lifts it.
        order: (N,) the order; before the window as it was, and behind it too.
        window: Its first position, and the one behind its last.
        was: The course of the order as it was.
        new: That of this one; its ranks do not count.

    Returns:
        The position from which on everything is as it was, only shifted; the end of the order if there is none.
    """
    first, behind = window
    before, states, carries_s = was.states, new.states, new.carried_s
    count, cranes = len(order), (states.shape[1] - STATE_COLUMNS) // 2
    raised, released = 2 * cranes + _RAISED, 2 * cranes + _RELEASED
    earlier, delivery = 2 * cranes + _EARLIER, 2 * cranes + _DELIVERY
    crews, placed, begun = 2 * cranes + _CREWS, 2 * cranes + _SET, 2 * cranes + _BEGUN
    width = states.shape[1]
    for column in range(width):  # numba copies a slice by way of memory that it allocates
        states[first, column] = before[first, column]
    for n in range(first, count):  # what comes later holds nothing up
        carries_s[order[n]] = 0.0
    for n in range(first, count):
        i = order[n]
        now = n + 1
        for column in range(width):
            states[now, column] = states[n, column]
        # When all that carries the part carries; before the window as in the course before.
        ready_s = 0.0
        for m in range(times.first[i], times.first[i + 1]):
            j = times.under[m]
            if states[n, begun] > 0.0:
                ready_s = max(ready_s, was.carried_s[j] if was.rank[j] < first else carries_s[j])
        # What no crane lifts is done by its crew, once what carries it carries and the parts before are released.
        k = crane[i]
        if k < 0:
            crew = times.crew[i]
            begins_s = max(ready_s, states[n, released])
            if crew < 3:
                begins_s = max(begins_s, states[n, crews + crew])
                states[now, crews + crew] = begins_s + times.work_s[i]
            carries_s[i] = begins_s + times.work_s[i] + times.hold_s[i]
            if states[n, begun] == 0.0:  # it is done before the clock starts
                states[now, crews] = states[now, crews + 1] = states[now, crews + 2] = 0.0
                carries_s[i] = 0.0
            continue
        if times.delivery[i] != states[n, delivery]:
            states[now, delivery], states[now, earlier] = times.delivery[i], states[n, released]
        # The earliest time at which the part hangs on the hook: the crane is free, its delivery is there, and it is
        # set after the one before.
        last = int(states[n, cranes + k])
        empty_s, carry_s = times.empty_s[k, last, i] if last >= 0 else 0.0, times.carry_s[k, i]
        hooked_s = max(
            states[n, k] + empty_s,
            states[n, raised],
            states[now, earlier],
            states[n, placed] - times.lead_s[i] - carry_s,
        )
        if cranes == 1:
            hooked_s = max(hooked_s, ready_s + empty_s)
        elif times.first[i + 1] > times.first[i]:
            hooked_s = max(hooked_s, ready_s, states[n, released])
        # The other cranes: clear of the motion that each made last.
        for other in range(cranes):
            before_it = int(states[n, cranes + other])
            if other != k and before_it >= 0:
                hooked_s = max(hooked_s, states[n, other] + waits_s(times.apart, (other, before_it), (k, i)))
                if times.beside[before_it, i]:  # its earlier ones stood by themselves before it was hooked on
                    hooked_s = max(hooked_s, states[n, other] - times.lead_s[i] - carry_s)
        # The state after the part.
        states[now, raised] = hooked_s + times.lead_s[i]
        states[now, placed] = states[now, raised] + carry_s
        states[now, k] = states[now, placed] + times.off_s[i]
        states[now, released] = max(states[n, released], states[now, k])
        states[now, cranes + k] = i
        states[now, begun] = 1.0
        carries_s[i] = states[now, k] + times.hold_s[i]
        # Behind the window, the same state at another time gives the same course.
        if n + 1 >= behind and len(times.under) == 0 and _is_shifted(before, states, now, cranes):
            return n + 1
    return count


@leaf_kernel
def _is_shifted(before: NDArray[np.float64], states: NDArray[np.float64], n: int, cranes: int) -> bool:
    """Return whether the states at a position, without other work, differ only by a time."""
    one, other = before[n], states[n]
    released, delivery = 2 * cranes + _RELEASED, 2 * cranes + _DELIVERY
    later_s = other[released] - one[released]
    if one[delivery] != other[delivery] or one[-1] != other[-1]:
        return False
    for k in range(cranes):
        if one[cranes + k] != other[cranes + k] or abs(other[k] - one[k] - later_s) > _SAME_S:
            return False
    same: bool = (
        abs(other[2 * cranes + _RAISED] - one[2 * cranes + _RAISED] - later_s) <= _SAME_S
        and abs(other[2 * cranes + _EARLIER] - one[2 * cranes + _EARLIER] - later_s) <= _SAME_S
        and abs(other[2 * cranes + _SET] - one[2 * cranes + _SET] - later_s) <= _SAME_S
    )
    return same
