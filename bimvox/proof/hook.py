"""The proof that the empty hook and the jib hit nothing, also of what other cranes carry and set meanwhile."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.crane.tower_crane import LuffingJib, TowerCrane
from bimvox.proof.guided import cells_at_any_heading
from bimvox.proof.load import LiftProof, things_over
from bimvox.proof.moment import NO_SOLID, Moment, Thing, fixed_things, near_and_far, set_thing, stored_thing
from bimvox.proof.space import Placements, positions_of, reference_cells, way_of, within
from bimvox.records.lift import Lift, LiftPlan, Status
from bimvox.records.motion import LiftMotion, PhaseName, Trajectory
from bimvox.records.proof import Check
from bimvox.site.component import Component
from bimvox.site.lifting import crane_for
from bimvox.site.site import Site, is_mast_of

_STEP_VOX = 0.5
_NEAR_VOX = 0.25


def _check_luffing_jib(
    check: Check,
    name: str,
    site: Site,
    crane: TowerCrane,
    jib: LuffingJib,
    present: Sequence[Thing],
    axes: NDArray[np.float64],
) -> None:
    """Check jib and counterweight over a whole motion.

    The jib is a band of its own width from pivot to tip; points every half cell along and across it are looked up in
    the occupied cells. The counterweight is the same band behind the axis, from its underside up.

    ``check``: receives the result; ``name``: the lift, for messages; ``crane``: its crane, with the slings of the load;
    ``present``: what is on the site; ``axes``: (N, 3) slew, radius, height of the samples.
    """
    taken = swept_by_jib(site, crane, jib, axes)
    check.look(True, "", samples=len(axes))
    for thing in present:
        met = not is_mast_of(crane, thing.name) and bool(_any_taken(taken, thing.cells))
        check.look(not met, f"{name}: the jib or its counterweight turns into {thing.name}")


@kernel
def _any_taken(taken: NDArray[np.bool_], cells: NDArray[np.int32]) -> bool:
    """Return whether any cell is occupied; cells outside the grid are free."""
    nx, ny, nz = taken.shape
    for n in range(cells.shape[0]):
        x, y, z = cells[n, 0], cells[n, 1], cells[n, 2]
        if 0 <= x < nx and 0 <= y < ny and 0 <= z < nz and taken[x, y, z]:
            return True
    return False


def swept_by_jib(site: Site, crane: TowerCrane, jib: LuffingJib, axes: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return the (X, Y, Z) cells that jib and counterweight sweep between samples ((N, 3)).

    Poses are so dense that neither the tip nor the counterweight's end is off by more than a quarter of a cell.
    Checked points are at most half a cell apart, along and across.
    """
    size_m = site.frame.voxel_size_m
    way = way_of(crane, axes, size_m).axes
    taken = np.zeros(site.shape, np.bool_)
    place = np.array([*crane.base_m[:2], *site.frame.origin_m, size_m])
    _mark_jib(
        taken,
        place,
        np.array([jib.pivot_offset_m, jib.pivot_height_m, jib.length_m, jib.width_m]),
        _apart(way[:, :2], np.array([_NEAR_VOX * size_m / jib.radii_m[1], _NEAR_VOX * size_m])),
    )
    _mark_tail(
        taken,
        place,
        np.array([jib.tail_radius_m, jib.tail_low_m, jib.pivot_height_m, jib.tail_width_m]),
        _apart(way[:, :1], np.array([_NEAR_VOX * size_m / jib.tail_radius_m]))[:, 0],
    )
    return taken


def _apart(poses: NDArray[np.float64], step: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return poses ((N, A)) on a grid of steps ((A,)), each once: none is off by more than half a step."""
    return np.asarray(np.unique(np.round(poses / step), axis=0) * step, np.float64)


@kernel
def _mark_jib(
    taken: NDArray[np.bool_], place: NDArray[np.float64], jib: NDArray[np.float64], poses: NDArray[np.float64]
) -> None:
    """Mark the cells of the jib's underside, a band from pivot to tip, at poses ((P, 2) slew, radius)."""
    origin_z, size = place[4], place[5]
    offset, pivot, length, width = jib
    along = int(np.ceil(length / (_STEP_VOX * size)))
    highest_m = origin_z + taken.shape[2] * size
    for p in range(poses.shape[0]):
        slew, radius = poses[p]
        reach = radius - offset
        rise = np.sqrt(max(length * length - reach * reach, 0.0))
        for n in range(along + 1):
            share = n / along
            height = pivot + share * rise
            if height > highest_m:
                break
            _mark_across(taken, place, slew, offset + share * reach, height, width)


@kernel
def _mark_tail(
    taken: NDArray[np.bool_], place: NDArray[np.float64], tail: NDArray[np.float64], slews: NDArray[np.float64]
) -> None:
    """Mark the cells of the counterweight, from its underside up to the pivot, at slewing angles."""
    origin_z, size = place[4], place[5]
    radius, low, pivot, width = tail
    step = _STEP_VOX * size
    back, up = int(np.ceil(radius / step)), max(1, int(np.ceil((pivot - low) / step)))
    highest_m = origin_z + taken.shape[2] * size
    for slew in slews:
        for k in range(up):
            height = low + 1e-6 + k * step
            if height > highest_m:
                break
            for n in range(back + 1):
                _mark_across(taken, place, slew, -min(n * step, radius), height, width)


@kernel
def _mark_across(
    taken: NDArray[np.bool_], place: NDArray[np.float64], slew: float, radius: float, height: float, width: float
) -> None:
    """Mark the cells on a level line across the whole width of a band, at a radius of its middle."""
    base_x, base_y, origin_x, origin_y, origin_z, size = place
    c, s = np.cos(slew), np.sin(slew)
    z = int(np.floor((height - origin_z) / size))
    if z < 0 or z >= taken.shape[2]:
        return
    lines = int(np.ceil(width / (_STEP_VOX * size)))
    for n in range(lines + 1):
        aside = (n / lines - 0.5) * width
        x = int(np.floor((base_x + radius * c - aside * s - origin_x) / size))
        y = int(np.floor((base_y + radius * s + aside * c - origin_y) / size))
        if 0 <= x < taken.shape[0] and 0 <= y < taken.shape[1]:
            taken[x, y, z] = True


def _check_load(
    check: Check,
    name: str,
    site: Site,
    crane: TowerCrane,
    jib: LuffingJib,
    component: Component,
    cells: NDArray[np.int32],
    axes: NDArray[np.float64],
) -> None:
    """Check that no column of the load reaches the jib above it.

    ``cells``: around the load, at every heading that it may have; ``axes``: (M, 3) poses of the hook then.
    """
    if not len(axes):
        return
    size_m = site.frame.voxel_size_m
    columns = np.unique(cells[:, :2], axis=0) - np.array(component.hook_line_vox[:2])
    slew, radius, height = axes.T
    share = np.clip((radius - jib.pivot_offset_m) / jib.length_m, -1.0, 1.0)
    slope = np.tan(np.arccos(share))
    top_m = height - crane.sling_m
    along = columns[:, 0] * np.cos(slew)[:, None] + columns[:, 1] * np.sin(slew)[:, None]
    aside = columns[:, 1] * np.cos(slew)[:, None] - columns[:, 0] * np.sin(slew)[:, None]
    # A cell column's radius is that of its nearest corner; it is below the jib if it is within the jib's width.
    at = radius[:, None] + (along - 0.5 * np.sqrt(2.0)) * size_m
    under = (np.abs(aside) - 0.5 * np.sqrt(2.0)) * size_m <= jib.width_m / 2.0
    jib_m = jib.pivot_height_m + (np.minimum(at, radius[:, None]) - jib.pivot_offset_m) * slope[:, None]
    bad = (under & (at > jib.pivot_offset_m) & (top_m[:, None] > jib_m)).any(axis=1)
    worst = int(np.argmax(bad))
    check.look(
        not bad.any(),
        f"{name}: at radius {radius[worst]:.2f} m the load reaches up into the jib",
        samples=len(axes),
    )


# What is on the site during the moves of an empty hook, if several cranes work in parallel.
#
# Between two lifts of a crane, other cranes pick parts from the yard and set them. So what is present depends on the
# time; it is derived from the motions.


class EmptyWay(NamedTuple):
    """A move of the empty hook.

    Attributes:
        what: Name of the move, for messages.
        way: Its samples.
        left: The part at whose place it starts; None if it starts elsewhere.
        present: What may be on the site during the move.
    """

    what: str
    way: Trajectory
    left: Component | None
    present: tuple[Thing, ...]


def one_way(site: Site, moment: Moment, motion: LiftMotion) -> tuple[EmptyWay, ...]:
    """Return the approach of a site's only crane, with what is on the site when the hook leaves the part before."""
    if motion.approach is None or moment.before is None:
        return ()
    arrived = set(moment.arrived)
    present = tuple(thing for thing in moment.present if thing not in arrived) if arrived else moment.present
    place = moment.lift.place
    if place is not None:
        own = place.shape.cells + np.array(place.cell_vox, np.int32)
        present = (*present, Thing(site.components[moment.lift.component].id, own, NO_SOLID))
    return (EmptyWay("approach", motion.approach, site.components[moment.before.component], present),)


class Turn(NamedTuple):
    """The times of a motion that decide where its part is, on the site's clock.

    Attributes:
        raised_ns: When it has left the yard.
        set_ns: When it is in place.
        released_ns: When its slings are off.
    """

    raised_ns: int
    set_ns: int
    released_ns: int


class Between:
    """Finds what is on the site during the empty hook moves of several cranes.

    Args:
        plan: The plan.
        turns: The times of the known motions, by order.
        context: Lifts that the plan does not contain.
    """

    def __init__(self, plan: LiftPlan, turns: Mapping[int, Turn], context: Collection[Lift]) -> None:
        self._site, self._turns = plan.site, turns
        self._lifts = sorted([*plan.lifts, *context], key=lambda lift: lift.order)
        self._fixed = fixed_things(plan.site)

    def before(self, lift: Lift) -> Lift | None:
        """Return the previous planned lift of the same crane."""
        crane = self._site.components[lift.component].crane
        result = None
        for other in self._lifts:
            if other.order >= lift.order:
                break
            if other.status is Status.PLANNED and self._site.components[other.component].crane == crane:
                result = other
        return result

    def ways(self, moment: Moment, motion: LiftMotion) -> Iterator[EmptyWay]:
        """Yield the empty hook moves of a lift, each with what may be on the site; ``moment`` is that of its crane."""
        components = self._site.components
        left = None if moment.before is None else components[moment.before.component]
        for what, name, whole, first in (
            ("approach", PhaseName.APPROACH, motion.approach, left),
            ("departure", PhaseName.LEAVE, motion.departure, components[moment.lift.component]),
        ):
            for n, (start_ns, end_ns, _) in enumerate(motion.ways_ns(name)):
                if whole is None:
                    continue  # inconsistent with the phases; another check reports it
                way = _cut(whole, start_ns - motion.start_ns, end_ns - motion.start_ns)
                if len(way.time_ns) >= 2:
                    yield EmptyWay(what, way, first if n == 0 else None, self._present(moment, start_ns, end_ns))

    def _present(self, moment: Moment, start_ns: int, end_ns: int) -> tuple[Thing, ...]:
        """Return what is on the site or in the yard at any time in a span.

        If the motion of a lift is unknown, its part is in place if it comes before the crane's last lift, and in the
        yard otherwise.
        """
        things = list(self._fixed)
        since = -1 if moment.before is None else moment.before.order
        first = self._delivery_at(start_ns, since)
        last = 0 if moment.lift.place is None else moment.lift.place.delivery
        for lift in self._lifts:
            turn = self._turns.get(lift.order)
            if lift.is_set and self._is_there(lift, turn, since, end_ns):
                things.append(set_thing(self._site, lift))
            if lift.in_yard is None or not first <= lift.in_yard.delivery <= max(last, first):
                continue
            planned = lift.status is Status.PLANNED
            lies = not planned or (lift.order > since if turn is None else turn.raised_ns > start_ns)
            if lift.is_set_otherwise:  # it leaves its stack when it is its turn
                lies = lift.order > moment.lift.order
            if lies:
                things.append(stored_thing(self._site, lift, lift.in_yard))
        return tuple(things)

    def _is_there(self, lift: Lift, turn: Turn | None, since: int, end_ns: int) -> bool:
        """Return whether a part may be in place before a time; by other means as soon as all earlier slings are off."""
        if turn is not None:
            return turn.set_ns < end_ns
        earlier = [one.order for one in self._lifts if one.order < lift.order and one.status is Status.PLANNED]
        if lift.order <= since or not lift.is_set_otherwise or any(order not in self._turns for order in earlier):
            return lift.order <= since
        return all(self._turns[order].released_ns < end_ns for order in earlier)

    def _delivery_at(self, at_ns: int, since: int) -> int:
        """Return the earliest delivery with a part that is not set yet."""
        left = [one.place.delivery for one in self._lifts if one.place and not self._is_over(one, at_ns, since)]
        return min(left, default=0)

    def _is_over(self, lift: Lift, at_ns: int, since: int) -> bool:
        """Return whether a lift no longer keeps its delivery in the yard."""
        if lift.status is not Status.PLANNED:
            return True
        turn = self._turns.get(lift.order)
        return lift.order <= since if turn is None else turn.released_ns <= at_ns


def _cut(way: Trajectory, start_ns: int, end_ns: int) -> Trajectory:
    inside = (way.time_ns >= start_ns) & (way.time_ns <= end_ns)
    no_corner = np.zeros(0, np.int64)
    return Trajectory(
        way.time_ns[inside], way.slew_rad[inside], way.radius_m[inside], way.height_m[inside], no_corner, way.bound_s
    )


_SLINGS_END = (0, 0, 0)
_AT_LINE_VOX = 1e-4


class HookProof(LiftProof):
    """Its checks are ``empty_hook``, ``zones`` and ``jib``."""

    def check(self, name: str, moment: Moment, motion: LiftMotion, ways: Sequence[EmptyWay] | None = None) -> None:
        """Check the empty hook moves of a lift, and the jib throughout the lift.

        If ``ways`` is None, the only empty hook move is its approach, with what is on the site at that moment.
        """
        self.start_ns = motion.start_ns
        for way in one_way(self.site, moment, motion) if ways is None else ways:
            self._check_approach(name, way, motion)
        time_ns, axes = motion.samples()
        first, last = np.searchsorted(time_ns, self.window_ns)
        seen = slice(max(int(first) - 1, 0), int(last) + 1)
        jib = self.crane.luffing
        present = (*moment.present, *(thing for way in ways or () for thing in way.present))
        if jib is None:
            self._check_jib(name, present, axes[seen])
            return
        component = self.site.components[moment.lift.component]
        crane = crane_for(self.site, self.crane, component)
        lift, since_ns = moment.lift, time_ns[seen] - motion.start_ns
        hangs = since_ns >= motion.raising.time_ns[0]
        # Stored turned, it is turned to its heading between the two.
        turned = lift.place is not None and lift.place.turn != 0
        any_heading = lift.ever_with_jib | (turned & (since_ns <= motion.loaded.time_ns[0]))
        check = self.checks["jib"]
        _check_luffing_jib(check, name, self.site, crane, jib, present, axes[seen])
        for cells, when in (
            (cells_at_any_heading(component), hangs & any_heading),
            (component.shape.cells, hangs & ~any_heading),
        ):
            _check_load(check, name, self.site, crane, jib, component, cells, axes[seen][when])

    def _check_approach(self, name: str, empty: EmptyWay, motion: LiftMotion) -> None:
        """Check that the cell at the slings' end and the line above it are free, also of the next part in the yard.

        Above a set point and a pick point, the line is in the column of the cell that holds it. Elsewhere it is one
        cell wide, so in up to four columns. When it leaves a set point, the line may pass through cells of what touches
        the part just set, if it misses the triangles.
        """
        check, frame, approach, left = self.checks["empty_hook"], self.site.frame, empty.way, empty.left
        way, cells, placements = positions_of(self.crane, frame, approach)
        at_lines = _in_own_columns(cells, self._own_columns(empty, motion))
        if (at_lines != cells).any():
            placements = Placements(at_lines, way.slack_vox)
        time_s = approach.time_ns[way.sample] / 1e9
        self.check_zones(f"{name}, {empty.what}", placements, None, cells, time_s)
        if not self.site.rules.rope:
            return
        present = empty.present
        self.cells.move_to(present)
        hit = placements.at_positions(self.cells.line_meets(placements, _SLINGS_END))
        check.look(True, "", samples=len(cells))
        leaving = np.logical_and.accumulate(hit) if left is not None else np.zeros(len(hit), np.bool_)
        bad = hit & ~leaving
        if left is not None and leaving.any():
            near, _ = near_and_far(left, present)
            with self.cells.without(near):
                bad |= leaving & placements.at_positions(self.cells.line_meets(placements, _SLINGS_END))
            set_at = np.array(left.target_vox) + np.array(left.hook_line_vox)
            for n in np.flatnonzero(leaving & ~bad).tolist():
                offset_m = (cells[n] - set_at) * frame.voxel_size_m
                bad[n] = not all(self.triangles.rope_is_clear(left, offset_m, thing.solid) for thing in near)
        bad &= within(approach, way, self.start_ns, self.window_ns)
        if bad.any():
            n = int(np.argmax(bad))
            met = ", ".join(things_over(present, placements, n, np.zeros(3, np.int64)))
            what = empty.what
            if left is not None and leaving[n]:
                # The hook cannot leave the set point of the previous part: that lift fails, not this one.
                check.about, what = left.id, f"{what} from {left.id}"
            when = f"{name}: on its {what}, at {time_s[n]:.2f} s"
            check.look(False, f"{when}, the empty hook or its rope meets {met}")

    def _own_columns(self, empty: EmptyWay, motion: LiftMotion) -> NDArray[np.float64]:
        """Return (N, 2) the lines above the set point that a move leaves and the pick point of the lift, in cells."""
        lines = reference_cells(self.crane, self.site.frame, motion.raising.axes[:1], _SLINGS_END)
        if empty.left is not None:
            left = np.array(empty.left.target_vox) + np.array(empty.left.hook_line_vox)
            lines = np.concatenate([lines, left[None]])
        return lines[:, :2]

    def _check_jib(self, name: str, present: Sequence[Thing], axes: NDArray[np.float64]) -> None:
        """Check that the jib, as wide as the mast, turns over nothing as high as itself.

        What extends above the grid's top is cut off and ignored.
        """
        crane, check = self.crane, self.checks["jib"]
        if not len(axes):
            return
        check.look(True, "", samples=len(axes))
        lowest = jib_cell(self.site, crane)
        if lowest >= self.site.shape[2]:
            return
        for thing in present:
            if thing.high[2] < lowest:
                check.look(True, "")
                continue
            met = not is_mast_of(crane, thing.name) and tallest_met(self.site, crane, thing.cells, axes[:, 0])
            check.look(
                not met, f"{name}: the jib at {crane.jib_height_m:g} m turns into {thing.name}, which is as high"
            )


def _in_own_columns(cells: NDArray[np.float64], lines: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return positions ((N, 3) cells); those from a line ((M, 2)) to the middle of its cell are moved to the middle."""
    moved = cells.copy()
    for line in lines:
        middle = np.rint(line)
        near = (np.abs(cells[:, :2] - middle) <= np.abs(line - middle) + _AT_LINE_VOX).all(axis=1)
        moved[near, :2] = middle
    return moved


def jib_cell(site: Site, crane: TowerCrane) -> int:
    """Return the lowest height, in cells, that reaches the jib."""
    return int(np.floor((crane.jib_height_m - site.frame.origin_m[2]) / site.frame.voxel_size_m + 1e-6))


def tallest_met(site: Site, crane: TowerCrane, cells: NDArray[np.int32], slew_rad: NDArray[np.float64]) -> bool:
    """Return whether the jib, as wide as the mast, turns into any of the cells ((N, 3)) that are as high as it is.

    ``slew_rad`` holds all slewing angles of the jib, (M,), unwrapped.
    """
    frame = site.frame
    tall = cells[cells[:, 2] >= jib_cell(site, crane)]
    if not len(tall):
        return False
    from_axis_m = frame.centre_of(tall)[:, :2] - np.array(crane.base_m[:2])
    radius_m = np.hypot(*from_axis_m.T)
    reached = radius_m <= crane.jib_length_m
    half_m = crane.mast_size_m / 2.0 + frame.voxel_size_m * np.sqrt(0.5)
    half_rad = np.arcsin(np.minimum(1.0, half_m / np.maximum(radius_m, 1e-9)))
    at_rad = np.arctan2(from_axis_m[:, 1], from_axis_m[:, 0])
    low, high = float(slew_rad.min()), float(slew_rad.max())
    # The first turn of each angle, less its half width, that is not before the slewing range.
    turned = low + np.remainder(at_rad + half_rad - low, 2.0 * np.pi)
    met: NDArray[np.bool_] = reached & (turned - 2.0 * half_rad <= high)
    return bool(met.any())
