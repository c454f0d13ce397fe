"""Which cranes stop with one that must stop, and which go on with what they are doing.

A crane goes on if it keeps its distance from where the others come to rest, and sets no part before an earlier one that
is held. If an empty hook is stopped, all cranes stop: a part may only be set after it has passed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

from bimvox.crane.conflict import CraneTrack, first_conflict
from bimvox.crane.outline import outline_of
from bimvox.cranes.track import approach_track, carrying_track
from bimvox.records.lift import Lift
from bimvox.records.motion import LiftMotion
from bimvox.revision.cranes_now import CraneNow
from bimvox.revision.stop_cranes import Loads, StoppedCranes
from bimvox.site.site import Site
from bimvox.stop.redirect import is_set
from bimvox.stop.resume import cut_short


class WhoStops:
    """Finds the cranes that stop.

    Args:
        site: The site.
        cranes: Its cranes now, by number.
        lifts: The lifts that have begun, by order.
        loads: The loads on the hooks.
        now_ns: The time on the site's clock.
    """

    def __init__(
        self, site: Site, cranes: Mapping[int, CraneNow], lifts: Mapping[int, Lift], loads: Loads, now_ns: int
    ) -> None:
        self._site, self._cranes, self._lifts, self._loads, self._now_ns = site, cranes, lifts, loads, now_ns

    def with_those(
        self, numbers: Iterable[int], stop: Callable[[list[CraneNow], Loads], StoppedCranes]
    ) -> StoppedCranes:
        """Return the cranes that stop because some must, stopped.

        Args:
            numbers: Those that must.
            stop: Stops cranes with their loads.
        """
        stopping = set(numbers)
        while True:
            cranes = [crane for number, crane in self._cranes.items() if number in stopping]
            stopped = stop(cranes, self._loads_of(stopping))
            left = [crane for number, crane in self._cranes.items() if number not in stopping]
            is_hook = any(self._is_under_way(crane) for crane in cranes)
            more = {crane.number for crane in left if is_hook or self._must_stop(crane, stopped)}
            if not more:
                return stopped
            stopping |= more

    def _loads_of(self, numbers: set[int]) -> Loads:
        def own(order: int) -> bool:
            return self._site.components[self._lifts[order].component].crane in numbers

        under_way = {order: motion for order, motion in self._loads.under_way.items() if own(order)}
        held = {order: one for order, one in self._loads.held.items() if own(order)}
        return self._loads._replace(under_way=under_way, held=held)

    def _is_under_way(self, crane: CraneNow) -> bool:
        """Return whether its empty hook moves."""
        return bool(crane.ways) and crane.ways[-1].end_ns > self._now_ns

    def _must_stop(self, crane: CraneNow, stopped: StoppedCranes) -> bool:
        loads = [order for order, motion in crane.motions.items() if not is_set(motion, self._now_ns)]
        first = min((load.lift.order for load in stopped.loads), default=max(loads, default=0))
        if any(order > first for order in loads):
            return True
        site, outline = self._site, outline_of(self._site.cranes[crane.number])
        rests = self._rests(stopped)
        return any(
            first_conflict(
                (outline_of(site.cranes[number]), outline),
                rest,
                track,
                site.rules.crane_separation_m,
                from_ns=self._now_ns,
            )
            is not None
            for track in self._doing(crane)
            for number, rest in rests
        )

    def _rests(self, stopped: StoppedCranes) -> list[tuple[int, CraneTrack]]:
        """Return the tracks of stopped loads until they rest, each with the number of its crane."""
        found = []
        for load in stopped.loads:
            order, number = load.lift.order, self._site.components[load.lift.component].crane
            held = self._loads.held.get(order)
            whole = self._loads.under_way[order] if held is None else held.motion
            found.append((number, self._track(self._lifts[order], cut_short(whole, load.stop), number)))
        return found

    def _doing(self, crane: CraneNow) -> Iterable[CraneTrack]:
        """Yield the tracks of what a crane does now: lifts whose slings are not off, and moves of its hook."""
        for order, motion in crane.motions.items():
            if motion.end_ns > self._now_ns:
                yield self._track(self._lifts[order], motion, crane.number)
        for way in crane.ways:
            if way.end_ns > self._now_ns:
                yield approach_track(self._site, self._site.cranes[crane.number], way.way, way.start_ns)

    def _track(self, lift: Lift, motion: LiftMotion, number: int) -> CraneTrack:
        return carrying_track(self._site, self._site.cranes[number], lift, motion)
