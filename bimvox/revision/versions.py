"""What was proven of lifts, now and earlier, with what its proof has read: it holds until some of that differs.

A revision asks for every lift what the walk over a plan asks of its store: was this found before, from the same? Here
the key cannot be a digest. A proof reads a few cells of a site (``footprint``), and any change makes another site. So a
``Version`` names what it read: the cells of its footprints, and the site's state then, a ``Reading``. It holds as long
as no cell of its footprint has become occupied (``footprint`` explains why that is enough): by an obstruction, by a
part that is now in place and was not then, or by one that now lies in the yard. If the state of a neighbour differs,
the lift is planned again, because its last moves depend on the neighbours in place. A motion also reads where the lift
before ends, and what is as high as the jib.

The version of a lift in the current plan comes first, so that most lifts are kept. Earlier ones follow: a change often
undoes an earlier one, and the lifts that an obstruction made infeasible, with all parts that rest on them, are feasible
again when it goes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from bimvox.grid.frame import NO_CELLS
from bimvox.motion.time_plan import KnownLegs
from bimvox.planning.occupancy import stored_cells, target_cells
from bimvox.planning.preparation import Preparation
from bimvox.proof.footprint import CellMask, Footprint, MotionFootprint, jib_meets, motion_footprint, path_footprint
from bimvox.records.lift import Lift, Status
from bimvox.records.motion import LiftMotion
from bimvox.site.collision import CLEARANCES, clearance_vox
from bimvox.site.component import IntVec
from bimvox.site.site import Site

T = TypeVar("T")

_KEPT = 3
"""Number of versions kept for each lift, that of the plan included."""


class Once(Generic[T]):
    """A value that is made when it is first asked for."""

    def __init__(self, make: Callable[[], T]) -> None:
        self._make: Callable[[], T] | None = make
        self._made: T | None = None

    def __call__(self) -> T:
        """Return the value; what made it is let go."""
        if self._make is not None:
            self._made, self._make = self._make(), None
        return self._made  # type: ignore[return-value]


@dataclass(frozen=True, slots=True, eq=False)
class Reading:
    """The state of a site before a lift, as far as it may change.

    Attributes:
        obstructed: The cells of all obstructions.
        done: The lifts done before it, as bits by order.
        before: The planned lift before it; None for the first.
    """

    obstructed: CellMask
    done: int = 0
    before: Lift | None = None

    def after(self, lift: Lift, *, is_set: bool) -> Reading:
        """Return the state after a lift."""
        before = lift if lift.status is Status.PLANNED else self.before
        return Reading(self.obstructed, self.done | is_set << lift.order, before)


@dataclass(frozen=True, slots=True, eq=False)
class Version:
    """A lift as it was proven, or found to be infeasible.

    Attributes:
        lift: The lift.
        read: The state of the site in which it holds.
        path: Makes the footprint of its path; of an infeasible lift, the cells that made it so.
        motion: Its motion; None if it is not timed.
        swept: Makes the footprint of the motion; None without one.
    """

    lift: Lift
    read: Reading
    path: Callable[[], Footprint]
    motion: LiftMotion | None = None
    swept: Callable[[], MotionFootprint] | None = None


Versions = Mapping[int, tuple[Version, ...]]
"""Versions by order of the lift: that of the current plan, if it is proven, then earlier ones, the latest first."""


def version_of(site: Site, lift: Lift, read: Reading, motion: LiftMotion | None) -> Version:
    """Return the version of a planned lift that was proven in a state of the site."""
    path = Once(partial(path_footprint, site, lift))
    if motion is None:
        return Version(lift, read, path)
    return Version(lift, read, path, motion, Once(partial(motion_footprint, site, lift, motion)))


def make_footprints(versions: Versions) -> None:
    """Make what is not made yet of the footprints that the next revision reads."""
    for version, *_ in versions.values():
        version.path()
        if version.swept is not None:
            version.swept()


def with_version(versions: tuple[Version, ...], new: Version) -> tuple[Version, ...]:
    """Return the versions of a lift with a new one in front of them, which replaces the same in an earlier state."""
    earlier = (one for one in versions if not _is_superseded(one, new))
    return (new, *earlier)[:_KEPT]


def _is_superseded(one: Version, new: Version) -> bool:
    return one.lift is new.lift and one.path is new.path and (one.swept is None or one.swept is new.swept)


def obstructed_cells(site: Site) -> CellMask:
    """Return the cells of all obstructions of a site."""
    mask = CellMask(site.shape)
    for blocker in site.blockers:
        if blocker.kind == "obstruction":
            mask.add(blocker.cells)
    return mask


@dataclass(eq=False)
class _Difference:
    """What differs before a lift from the state that a version has read.

    Attributes:
        occupied: Cells that were free and are occupied now, with what is in the yard for the delivery of the lift.
        changed: All cells whose state differs.
        has_occupied: Whether anything is occupied now that was free.
        freed: Around cells that something has left: (2, 3) opposite corners of boxes; (0, 3) of none.
        near: Neighbours of the parts whose state differs.
    """

    occupied: CellMask
    changed: CellMask
    has_occupied: bool
    freed: list[NDArray[np.int32]]
    near: set[int] = field(default_factory=set)

    @cached_property
    def cells(self) -> NDArray[np.int32]:
        """(N, 3) the cells of ``occupied``, which every motion is held against."""
        return self.occupied.cells()


class Validity:
    """Tells which versions hold on a site, as its lifts are gone through in order.

    Args:
        versions: Versions by order.
        site: The site with its obstructions now.
        preparation: What was prepared for it.

    Attributes:
        now: The state of the site before the lift that is asked about; it is to be set at every lift.
    """

    def __init__(self, versions: Versions, site: Site, preparation: Preparation) -> None:
        self._versions, self._site, self._preparation = versions, site, preparation
        self._margin = max(clearance_vox(site, rule) for rule in CLEARANCES)
        self._differences: dict[tuple[int, int, int, int], _Difference] = {}
        self.now = Reading(obstructed_cells(site))

    def of(self, lift: Lift) -> Version | None:
        """Return the version of exactly this lift; None if it is not proven."""
        return next((one for one in self._versions.get(lift.order, ()) if one.lift is lift), None)

    def path(self, lift: Lift) -> Version | None:
        """Return a version whose path is still proven: of this lift, otherwise the latest earlier one that is."""
        versions = self._versions.get(lift.order, ())
        for version in sorted(versions, key=lambda one: one.lift is not lift):
            if version.lift.status is Status.PLANNED and self.path_holds(version):
                return version
        return None

    def is_beside_change(self, lift: Lift, read: Reading) -> bool:
        """Return whether the state of a neighbour differs from what was read for a lift."""
        return lift.component in self._since(read, lift).near

    def path_holds(self, version: Version) -> bool:
        """Return whether the path of a version is still proven."""
        since = self._since(version.read, version.lift)
        return version.lift.component not in since.near and not since.occupied.meets(version.path())

    def reason_holds(self, version: Version) -> bool:
        """Return whether no cell has changed that made a version's lift infeasible."""
        return not self._since(version.read, version.lift).changed.meets(version.path())

    def motion(self, lift: Lift) -> Version | None:
        """Return the first version of exactly this path whose motion is still proven; None if none is."""
        for version in self._versions.get(lift.order, ()):
            motion, swept = version.motion, version.swept
            if version.lift is not lift or motion is None or swept is None:
                continue
            if not same_part(version.read.before, self.now.before) or not self.path_holds(version):
                continue
            since = self._since(version.read, lift)
            if not since.occupied.meets(swept()) and not self._jib_meets(since, motion):
                return version
        return None

    def legs(self, lift: Lift) -> KnownLegs:
        """Return a lift whose motion as a whole is not known, with what of a motion is still proven."""
        for version in self._versions.get(lift.order, ()):
            motion, swept = version.motion, version.swept
            if motion is None or swept is None or not self._begins_as(version, motion, lift):
                continue
            since = self._since(version.read, version.lift)
            if self._jib_meets(since, motion):
                continue
            if not since.occupied.meets(swept().approach):
                return KnownLegs(lift.order, approach=motion.approach)
            if version.lift is lift and self.path_holds(version) and not since.occupied.meets(swept().carrying):
                return KnownLegs(lift.order, carrying=motion)
        return KnownLegs(lift.order)

    def fewest_are_known(self, lift: Lift, read: Reading) -> bool:
        """Return whether the fewest moves of a lift are still those that it states.

        A kept path witnesses that its number of moves is possible. A path with fewer moves would need a placement that
        was blocked before: its cells, or the column above its hook, hold a cell that is free now. So if the shortest
        way from the start to the target through the box of all these placements is no shorter, the fewest moves are
        still the same.

        Args:
            lift: The lift, which states the fewest moves in a state of the site.
            read: That state.
        """
        path, fewest = lift.path_vox, lift.shortest_moves
        if path is None or fewest is None:
            return True
        start, target = path[0].tolist(), path[-1].tolist()
        if fewest <= sum(abs(one - other) for one, other in zip(start, target, strict=True)):
            return True
        since = self._since(read, lift)
        if since.has_occupied and len(path) - 1 > fewest:
            return False  # what is occupied now may be on all paths as short as that
        size = self._site.components[lift.component].shape.size_vox
        return all(self._least_moves(start, target, size, *box.tolist()) >= fewest for box in since.freed if len(box))

    def _least_moves(self, start: list[int], target: list[int], size: IntVec, low: list[int], high: list[int]) -> int:
        """Return the fewest moves by a placement at which a part or the rope above it meets a box of cells.

        ``start``: where the path begins; ``target``: where it ends; ``size``: the part's size; ``low``: the lowest cell
        of the box; ``high``: the highest cell of the box.
        """
        moves, margin = 0, self._margin
        for axis, (one, other) in enumerate(zip(start, target, strict=True)):
            first, last = min(one, other), max(one, other)
            below = 0 if axis == 2 else low[axis] - size[axis] + 1 - margin  # the rope is above the part
            moves += last - first + 2 * max(0, first - high[axis] - margin, below - last)
        return moves

    def _begins_as(self, version: Version, motion: LiftMotion, lift: Lift) -> bool:
        """Return whether a lift begins where a version of it does, which was not stopped on its way to the part."""
        last, before, then, place = version.read.before, self.now.before, version.lift.place, lift.place
        if last is None or before is None or then is None or place is None or motion.stops_ns:
            return False
        same_end = last is before or (
            same_part(last, before) and np.array_equal(last.last_moves_vox, before.last_moves_vox)
        )
        return same_end and then.is_same(place)

    def _jib_meets(self, since: _Difference, motion: LiftMotion) -> bool:
        return not since.occupied.empty and jib_meets(self._site, motion, since.cells)

    def _since(self, read: Reading, lift: Lift) -> _Difference:
        """Return what differs from a state before a lift, which is in the yard with others of its delivery."""
        now = self.now
        set_since, not_set = now.done & ~read.done, read.done & ~now.done
        delivery = -1 if lift.place is None or not not_set else lift.place.delivery
        key = (id(read.obstructed), set_since, not_set, delivery)
        if key not in self._differences:
            self._differences[key] = self._difference(read.obstructed, set_since, not_set, delivery)
        return self._differences[key]

    def _difference(self, obstructed: CellMask, set_since: int, not_set: int, delivery: int) -> _Difference:
        now, places = self.now.obstructed, self._preparation.places
        order, neighbours = self._preparation.sequence.order, self._preparation.contacts.neighbours
        occupied, left = now.without(obstructed), obstructed.without(now)
        result = _Difference(occupied, occupied.union(left), not occupied.empty, [left.around()])
        for n in _bits(set_since | not_set):
            index, place = order[n], places[order[n]]
            target = target_cells(self._site.components[index])
            stored = NO_CELLS if place is None else stored_cells(place)
            result.changed.add(target)
            result.changed.add(stored)
            is_set = bool(set_since >> n & 1)
            if is_set or (place is not None and place.delivery == delivery):
                occupied.add(target if is_set else stored)
            result.has_occupied |= is_set or place is not None
            result.freed.append(_box_around(stored if is_set else target))
            result.near.update(neighbours[index])
        return result


def same_part(lift: Lift | None, other: Lift | None) -> bool:
    """Return whether two lifts, or their absence, are of the same part."""
    return lift is other or (lift is not None and other is not None and lift.component == other.component)


def _box_around(cells: NDArray[np.int32]) -> NDArray[np.int32]:
    """Return two opposite corners (2, 3) of a box around (N, 3) cells; none (0, 3) around none."""
    return np.stack([cells.min(axis=0), cells.max(axis=0)]) if len(cells) else cells


def _bits(number: int) -> list[int]:
    """Return the positions of the bits that are set, ascending."""
    return [n for n in range(number.bit_length()) if number >> n & 1]
