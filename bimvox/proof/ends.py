"""The proof that a motion begins and ends where the plan says; where its last moves begin, read from the site."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.kinematics import hook_of
from bimvox.crane.tower_crane import TowerCrane
from bimvox.proof.flip import is_turned_over
from bimvox.proof.moment import Moment
from bimvox.proof.space import hits, reference_cells, whole_cells
from bimvox.records.lift import Lift, YardPlace
from bimvox.records.motion import LiftMotion, PhaseName, quarters_of
from bimvox.records.proof import Check
from bimvox.site.component import Component, IntVec, StoredPose
from bimvox.site.lifting import crane_for
from bimvox.site.site import Site

_SAME_M = 1e-3
_SAME_RAD = 1e-6
_AROUND_VOX = 1.0 + 1e-3
"""How far the first placement of a path may be from a load at rest that resumes on it."""


def check_ends(
    check: Check,
    name: str,
    site: Site,
    crane: TowerCrane,
    moment: Moment,
    motion: LiftMotion,
    previous: LiftMotion | None,
) -> None:
    """Check the start and end of every trajectory of a lift, within a millimetre.

    ``previous`` is the motion of the planned lift before it, if known.
    """
    component, place = site.components[moment.lift.component], moment.lift.place
    usual, crane = crane, crane_for(site, crane, component)
    if place is None:
        check.look(False, f"{name}: it has no place in the yard")
        return
    raising, loaded = motion.raising.axes, motion.loaded.axes

    def same(what: str, axes: NDArray[np.float64], wanted_m: NDArray[np.float64]) -> None:
        hook_m = hook_of(crane, *axes)
        off_m = float(np.linalg.norm(hook_m - wanted_m))
        check.measure(off_m)
        check.look(off_m <= _SAME_M, f"{name}: {what} with the hook at {_text(hook_m)}, not at {_text(wanted_m)}")

    same("the load's way starts", loaded[0], _hook_over(site, crane, component, place.transit_start_vox))
    same("the load's way ends", loaded[-1], _hook_over(site, crane, component, component.target_vox))
    same("it is raised", raising[-1], hook_of(crane, *loaded[0]))
    _check_resumed(check, name, site, crane, moment.lift, motion)
    _check_hooked_on(check, name, site, crane, moment, raising)
    first = raising[0]
    if motion.approach is not None:
        approach = motion.approach.axes
        first = approach[0]
        same("the empty hook arrives", approach[-1], hook_of(crane, *raising[0]))
    aside = motion.approach is not None and moment.before is None and PhaseName.WAIT in {p.name for p in motion.phases}
    check.look(
        aside or (motion.approach is None) == (moment.before is None),
        f"{name}: the first lift, and no other, begins without an approach",
    )
    if motion.departure is not None:
        same("it leaves", motion.departure.axes[0], hook_of(crane, *loaded[-1]))
    if moment.before is not None:
        left = site.components[moment.before.component]
        same("the empty hook starts", first, _hook_over(site, crane_for(site, usual, left), left, left.target_vox))
    left_ns = motion.start_ns + int(motion.loaded.time_ns[0])
    turned = [phase for phase in motion.phases if phase.name is PhaseName.TURN and phase.end_ns <= left_ns]
    wanted_ns = round(quarters_of(place.turn) * site.rules.turn_s * 1e9)
    check.look(
        sum(phase.end_ns - phase.start_ns for phase in turned) == wanted_ns,
        f"{name}: lies turned by {place.turn} quarters, but is not turned back in {wanted_ns / 1e9:g} s",
    )
    turns = [loaded[0][0] - raising[-1][0]]
    if motion.approach is not None:
        turns.append(raising[0][0] - motion.approach.axes[-1][0])
    if previous is not None:
        turns.append(first[0] - previous.loaded.axes[-1][0])
    check.look(
        bool(np.abs(turns).max() <= _SAME_RAD),
        f"{name}: between its parts, or since the lift before, the crane turned by {np.abs(turns).max():.6f} rad",
    )


def _check_resumed(check: Check, name: str, site: Site, crane: TowerCrane, lift: Lift, motion: LiftMotion) -> None:
    """Check that a path found after a stop begins at a placement around the load, where its crane resumes."""
    component, loaded = site.components[lift.component], motion.loaded
    stops_ns = [end_ns for _, end_ns in motion.stops_ns]
    found = [*(left.path_vox for left in lift.left), lift.path_vox][1:]
    for left, path_vox in zip(lift.left, found, strict=True):
        assert path_vox is not None
        resumed_ns = min((end_ns for end_ns in stops_ns if end_ns > left.until_ns), default=left.until_ns)
        at_ns = resumed_ns - motion.start_ns
        axes = np.array([[np.interp(at_ns, loaded.time_ns, axis) for axis in loaded.axes.T]])
        load = reference_cells(crane, site.frame, axes, component.hook_line_vox)[0]
        check.look(
            bool((np.abs(load - path_vox[0]) <= _AROUND_VOX).all()),
            f"{name}: its path after the stop begins at {site.frame.in_words(path_vox[0])}, but the load resumes at "
            f"{site.frame.in_words(load)}",
        )


def _check_hooked_on(
    check: Check, name: str, site: Site, crane: TowerCrane, moment: Moment, axes: NDArray[np.float64]
) -> None:
    """Check that the end of the slings is on top of the part as it lies; if it is upright, above its centre of mass.

    ``axes`` are the (N, 3) samples of its raising.
    """
    place = moment.lift.place
    assert place is not None
    component = site.components[moment.lift.component]
    slings_end = np.array([0.0, 0.0, crane.sling_m])
    foot_m = hook_of(crane, *axes[0]) - slings_end
    low_m = site.frame.corner_of(place.cell_vox)
    high_m = site.frame.corner_of(np.array(place.cell_vox) + place.shape.size_vox)
    over = bool((foot_m[:2] >= low_m[:2] - _SAME_M).all() and (foot_m[:2] <= high_m[:2] + _SAME_M).all())
    if is_turned_over(component, place):
        over = _is_above_head(site, crane, component, place, axes)
    check.look(
        over and abs(float(foot_m[2] - high_m[2])) <= _SAME_M,
        f"{name}: is hooked on at {_text(foot_m)}, but its top in the yard is {_text(low_m)} to {_text(high_m)}",
    )
    if place.pose is not StoredPose.AS_BUILT:
        return
    # It hangs level from its yard to its place: the hook is above its centre of mass as it lies, too.
    x, y = (n + 0.5 for n in component.hook_line_vox[:2])
    width, depth, _ = component.shape.size_vox
    turned = ((x, y), (depth - y, x), (width - x, depth - y), (y, width - x))[place.turn % 4]
    wanted_m = site.frame.corner_of(np.add(place.cell_vox, (*turned, 0)))[:2]
    off_m = float(np.hypot(*(foot_m[:2] - wanted_m)))
    check.look(off_m <= _SAME_M, f"{name}: is hooked on {off_m:.3f} m away from the vertical above its centre of mass")
    if place.turn:
        hook_m = hook_of(crane, *axes.T)
        low = hook_m[:, 2] < hook_m[-1, 2] - _SAME_M
        gone_m = float(np.hypot(*(hook_m[low, :2] - hook_m[0, :2]).T).max(initial=0.0))
        check.look(gone_m <= _SAME_M, f"{name}: moves sideways by {gone_m:.3f} m while it is raised to be turned")


def _is_above_head(
    site: Site, crane: TowerCrane, component: Component, place: YardPlace, axes: NDArray[np.float64]
) -> bool:
    """Return whether the main hook goes straight up above a part's head until it hangs upright, below its middle.

    As it is lifted, the part moves under the hook by its thickness at most.
    """
    hook_m = hook_of(crane, *axes.T)
    rising = hook_m[:, 2] < hook_m[-1, 2] - _SAME_M
    straight = bool((np.hypot(*(hook_m[rising, :2] - hook_m[0, :2]).T) <= _SAME_M).all())
    axis = 0 if place.pose is StoredPose.LYING_X else 1
    low_m, high_m = (
        site.frame.corner_of(np.array(place.cell_vox) + np.array(size)) for size in ((0, 0, 0), place.shape.size_vox)
    )
    slack_m = float(high_m[2] - low_m[2]) + site.frame.voxel_size_m
    along = abs(float(hook_m[0, axis] - high_m[axis])) <= slack_m
    return straight and along and low_m[1 - axis] - _SAME_M <= hook_m[0, 1 - axis] <= high_m[1 - axis] + _SAME_M


def _hook_over(site: Site, crane: TowerCrane, component: Component, cell_vox: IntVec) -> NDArray[np.float64]:
    """Return (3,) the hook position for a component's reference cell at a placement, metres."""
    cell = np.array(cell_vox) + np.array(component.hook_line_vox) + [0.5, 0.5, 0.0]
    return np.asarray(site.frame.corner_of(cell) + np.array([0.0, 0.0, crane.sling_m]), np.float64)


def _text(point_m: NDArray[np.float64]) -> str:
    return "(" + ", ".join(f"{value:.3f}" for value in point_m) + ") m"


def gate_of(
    site: Site, lift: Lift, component: Component, counts: NDArray[np.uint16], wide: NDArray[np.uint16] | None
) -> int:
    """Return the number of the placement at which the last moves begin.

    It is the one that the plan states. But if a later placement is above the part's place, with all clearances kept
    there and all the way up, the load is in transit until then: from there it could be raised out.

    Args:
        site: The site.
        lift: A lift with a path.
        component: Its part.
        counts: (X, Y, Z) how many things occupy each cell.
        wide: The same, the largest within the transit clearance; None if the rules ask for none.
    """
    path = lift.path_vox
    assert path is not None
    stated = max(0, len(path) - 1 - lift.contact_moves)
    clear_vox = _clear_from(site, lift, counts, wide)
    above = (path[:, :2] == np.array(component.target_vox[:2])).all(axis=1) & (path[:, 2] >= clear_vox)
    found = np.flatnonzero(above)
    return max(stated, int(found[-1])) if len(found) else stated


def _clear_from(site: Site, lift: Lift, counts: NDArray[np.uint16], wide: NDArray[np.uint16] | None) -> int:
    """Return the height from which a part is clear of everything above its place; above the site if it never is."""
    component = site.components[lift.component]
    margin, rope = (
        whole_cells(site.rules.kept_m(rule, lift.kept), site.frame)
        for rule in ("transit_clearance_m", "rope_clearance_m")
    )
    low, size, shape = np.array(component.target_vox), np.array(component.shape.size_vox), np.array(site.shape)
    heights = np.arange(low[2], shape[2] - size[2] - margin + 1)
    inside = (low[:2] >= margin).all() and (low[:2] + size[:2] + margin <= shape[:2]).all()
    if not inside or not len(heights):
        return site.shape[2]
    near = np.zeros(len(heights), np.bool_)
    if wide is not None:
        column = np.column_stack([np.full(len(heights), n) for n in low[:2]] + [heights]).astype(np.int64)
        near |= hits(wide, component.shape.cells, column)
    if site.cranes and site.rules.rope and rope > 0:
        x, y, z = (low + np.array(component.hook_offset_vox)).tolist()
        beside = counts[max(0, x - rope) : x + rope + 1, max(0, y - rope) : y + rope + 1].any(axis=(0, 1))
        highest = int(np.flatnonzero(beside).max(initial=-1))
        near |= z + (heights - low[2]) <= highest
    last = int(np.flatnonzero(near).max(initial=-1))
    return int(heights[last + 1]) if last + 1 < len(heights) else site.shape[2]
