"""What holds each lifted part when its slings come off: chosen when all ways are known.

Props go when the joints of the part and of all floors that hold its head carry, or the concrete of these floors does.
Shores below a plank go when its topping carries. What nothing in the plan takes over stays until its designer says so.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
import shapely
from numpy.typing import NDArray

from bimvox.kept import kept
from bimvox.motion.prop_places import Places, body_of, thick_m
from bimvox.motion.prop_room import Room
from bimvox.motion.prop_times import NEVER_NS, timeline
from bimvox.motion.steps import Resting, steps_of
from bimvox.records.lift import Lift, LiftPlan, Status
from bimvox.records.motion import LiftMotion
from bimvox.records.props import Held, Hold, Prop, Props
from bimvox.records.steps import Steps
from bimvox.site.component import Component
from bimvox.site.means import Means
from bimvox.site.props import PropRules
from bimvox.site.site import Site
from bimvox.site.work import Work, kind_of, work_of

_Floats = NDArray[np.float64]

_UPRIGHT = frozenset((Work.COLUMN, Work.WALL))
_SPANNING = frozenset((Work.BEAM, Work.SLAB, Work.STAIR))
_SQUAT = 2.0
"""What is not higher than this many times its thickness stands by itself."""
_UPPER = 0.6
"""What touches a part above this share of its height holds its head."""
_TOUCH_M = 0.06
_ALIGNED = 0.7


@kept
def props_of(plan: LiftPlan, motions: tuple[LiftMotion, ...], context: tuple[Lift, ...] = ()) -> Props:
    """Return what holds the lifted parts of a plan; nothing if its rules ask for none, or it has no motions.

    Nothing of an extract, because it follows from all lifts.

    Args:
        plan: The plan, or what a log carries of it.
        motions: Its motions.
        context: Lifts of the same plan that it does not contain.
    """
    rules, by_order = plan.site.rules.props, {motion.order: motion for motion in motions}
    planned = sum(lift.status is Status.PLANNED for lift in plan.lifts)
    if rules is None or context or not motions or len(motions) < planned:
        return Props()
    steps = steps_of(plan.site, plan.lifts, motions)
    return Props(tuple(_Choice(plan.site, plan.lifts, by_order, steps, rules).held()))


class _Choice:
    """Chooses what holds one part after the other."""

    def __init__(
        self, site: Site, lifts: Sequence[Lift], motions: Mapping[int, LiftMotion], steps: Steps, rules: PropRules
    ) -> None:
        self._parts, self._frame, self._rules, self._motions = site.components, site.frame, rules, motions
        self._lifts = sorted((lift for lift in lifts if lift.is_set), key=lambda lift: lift.order)
        self._times = timeline(site, self._lifts, motions, steps)
        self._resting = Resting(site, lifts)
        self._under = {lift.component: self._resting.on(lift.component, held=False) for lift in self._lifts}
        self._on = defaultdict[int, list[int]](list)
        for above, under in self._under.items():
            for below in under:
                self._on[below].append(above)
        self._room = Room(site, self._lifts, self._times)
        self._bounds_m = self._room.bounds_m[: len(self._parts)]
        self._inside_m = self._bounds_m[:, :, :2].mean(axis=(0, 1))

    def held(self) -> Iterator[Held]:
        """Yield what holds each lifted part, in the order of the lifts."""
        for lift in self._lifts:
            if lift.status is Status.PLANNED and lift.order in self._motions:
                part = self._parts[lift.component]
                one = self._upright(lift, part) if kind_of(part) in _UPRIGHT else self._lying(lift, part)
                if one.props:
                    span_ns = (one.from_ns, NEVER_NS if one.until_ns is None else one.until_ns)
                    clear_m = min(self._room.past_m(part, prop, span_ns, self._rules.clearance_m) for prop in one.props)
                    holds_up = self._room.holding_up(part, one.props, span_ns)
                    self._room.add(one.props, span_ns)
                    one = replace(one, holds_up=holds_up, clear_m=round(clear_m, 3))
                yield one

    def _held(
        self, lift: Lift, hold: Hold, by: Sequence[int], props: tuple[Prop, ...] = (), waits: tuple[int, ...] = ()
    ) -> Held:
        until_ns = max((self._times.carries_ns[n] for n in waits), default=None)
        return Held(
            lift.order, lift.component, hold, tuple(by), props, self._times.there_ns[lift.component], until_ns, waits
        )

    def _places(self, part: Component, waits: Sequence[int]) -> Places:
        """Return the places for props of a part that go when what they wait for carries; never without."""
        until_ns = max((self._times.carries_ns[n] for n in waits), default=NEVER_NS)
        span_ns = (self._times.there_ns[part.index], until_ns)
        x, y, _ = part.hook_line_vox
        centre_m = self._frame.corner_of(np.array(part.target_vox) + np.array([x + 0.5, y + 0.5, 0.0]))[:2]
        return Places(part, centre_m, self._inside_m, span_ns, self._rules, self._room)

    # What stands.

    def _upright(self, lift: Lift, part: Component) -> Held:
        body = body_of(part.mesh)
        if work_of(part) is Work.STEEL or body.high_m <= _SQUAT * body.wide_m:
            return self._held(lift, Hold.BASE, self._under[part.index])
        ties = self._ties(part)
        waits = (part.index, *ties) if ties else ()
        places = self._places(part, waits)
        if kind_of(part) is Work.COLUMN:
            props, without = places.of_a_column()
        else:
            props = places.of_a_wall()
            without = () if props else (body.across,)
        beside = self._beside(part, without)
        if without and not beside:
            return self._held(lift, Hold.NOTHING, ())
        if not props:
            return self._held(lift, Hold.NEIGHBOURS, beside)
        return self._held(lift, Hold.PROPS, beside, props, waits)

    def _ties(self, part: Component) -> tuple[int, ...]:
        """Return the floors that hold the head of an upright part: they rest on it, or touch its upper part.

        With a beam come the floors that rest on it. A wall is held by a floor only; to a column, which its own joint
        holds, beams are enough.
        """
        low_m, high_m = self._bounds_m[part.index, :, 2]
        upper_m = low_m + _UPPER * (high_m - low_m)
        found = {n for n in self._on[part.index] if self._bounds_m[n, 1, 2] > upper_m}
        found.update(self._touching(part, upper_m))
        beams = [n for n in found if kind_of(self._parts[n]) is Work.BEAM]
        found.update(n for beam in beams for n in self._on[beam])
        there_ns = self._times.there_ns
        ties = sorted(n for n in found if kind_of(self._parts[n]) in _SPANNING and there_ns[n] < NEVER_NS)
        floored = kind_of(part) is Work.COLUMN or any(kind_of(self._parts[n]) is Work.SLAB for n in ties)
        return tuple(ties) if floored else ()

    def _touching(self, part: Component, low_m: float) -> list[int]:
        """Return the components whose boxes touch that of a part above a height."""
        low, high = self._bounds_m[part.index]
        low = np.array([low[0], low[1], low_m])
        near = (self._bounds_m[:, 0] <= high + _TOUCH_M).all(axis=1)
        near &= (self._bounds_m[:, 1] >= low - _TOUCH_M).all(axis=1)
        near[part.index] = False
        return [int(n) for n in np.flatnonzero(near)]

    def _beside(self, part: Component, without: Sequence[_Floats]) -> tuple[int, ...]:
        """Return the earlier uprights that hold a part in directions without props; none if a direction has none.

        They touch it at half its height, and are long in that direction.
        """
        low_m, high_m = self._bounds_m[part.index, :, 2]
        middle_m, found = (low_m + high_m) / 2.0, set[int]()
        near = [
            n
            for n in (self._touching(part, low_m) if without else ())
            if kind_of(self._parts[n]) in _UPRIGHT
            and self._is_earlier(n, part)
            and self._bounds_m[n, 0, 2] <= middle_m <= self._bounds_m[n, 1, 2]
        ]
        for axis in without:
            along = [n for n in near if abs(body_of(self._parts[n].mesh).along @ axis) > _ALIGNED]
            if not along:
                return ()
            found.update(along)
        return tuple(sorted(found))

    def _is_earlier(self, n: int, part: Component) -> bool:
        return self._times.there_ns[n] <= self._times.there_ns[part.index]

    # What spans.

    def _lying(self, lift: Lift, part: Component) -> Held:
        under = self._under[part.index]
        if topping := self._topping_of(part):
            waits = (part.index, *topping)
            on_it_kg = sum(self._share_on(part, self._parts[n]) for n in topping)
            shores = self._places(part, waits).below_a_plank(on_it_kg)
            return self._held(lift, Hold.SHORES if shores else Hold.NOTHING, under, shores, waits if shores else ())
        columns = self._resting.bearing(part.index) if under and kind_of(part) in _SPANNING else np.zeros((0, 2))
        if len(columns):
            size_m = self._frame.voxel_size_m
            bearing_m = self._frame.centre_of(np.column_stack([columns, np.zeros(len(columns), int)]))[:, :2]
            cast = tuple(sorted(n for n in self._on[part.index] if self._parts[n].means is Means.IN_SITU))
            waits = (part.index, *cast) if cast else ()  # without what is cast on it, its designer says how it is held
            places = self._places(part, waits)
            held = shapely.MultiPoint(bearing_m).convex_hull.buffer(size_m)
            if not held.contains(shapely.Point(*places.centre_m)):
                shores = places.where_it_overhangs(bearing_m, size_m)
                return self._held(lift, Hold.SHORES if shores else Hold.NOTHING, under, shores, waits if shores else ())
        if under or self._resting.is_grounded(part):
            return self._held(lift, Hold.BEARING, under)
        beside = [n for n in self._touching(part, self._bounds_m[part.index, 0, 2]) if self._is_earlier(n, part)]
        return self._held(lift, Hold.NEIGHBOURS if beside else Hold.NOTHING, beside)

    def _topping_of(self, part: Component) -> tuple[int, ...]:
        """Return the floors that are cast on a thin plank later; none if it is not one."""
        if kind_of(part) is not Work.SLAB or thick_m(part.mesh) > self._rules.plank_m:
            return ()
        cast = (n for n in self._on[part.index] if self._parts[n].means is Means.IN_SITU)
        return tuple(sorted(n for n in cast if kind_of(self._parts[n]) is Work.SLAB))

    def _share_on(self, part: Component, topping: Component) -> float:
        """Return the mass of a topping over a plank, by their areas."""
        areas_m2 = body_of(part.mesh).area_m2, body_of(topping.mesh).area_m2
        return topping.mass_kg * min(1.0, areas_m2[0] / max(areas_m2[1], 1e-9))
