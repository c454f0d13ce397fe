"""The proof of racks in the yard: which walls stand in one, in which order, and the room for its frame."""

from __future__ import annotations

from collections.abc import Collection
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bimvox.proof.space import whole_cells
from bimvox.proof.storage import ground_under
from bimvox.records.lift import Lift, YardPlace
from bimvox.records.proof import Check
from bimvox.site.component import Component, StoredPose
from bimvox.site.site import Site
from bimvox.site.work import Work, kind_of

Span = tuple[NDArray[np.int64], NDArray[np.int64]]
"""First and last column of a rectangle, both inclusive."""
_HEAD_M = 2.0
"""Up to this height above the ground, something is in the way of the frame."""
_EPS = 1e-6


def rack_of(lift: Lift) -> tuple[int, int] | None:
    """Return delivery and number of the rack that a part stands in; None if in none."""
    place = lift.place
    return None if place is None or not place.rack else (place.delivery, abs(place.rack))


def frames_of(site: Site, lifts: Collection[Lift]) -> dict[tuple[int, int], Span]:
    """Return the columns of each rack's frame, by delivery and number of the rack; none if the rules have no racks."""
    if site.rules.yard is None or site.rules.yard.rack_parts < 1:
        return {}
    return {key: _frame(site, members) for key, members in _racks(lifts).items()}


def _racks(lifts: Collection[Lift]) -> dict[tuple[int, int], list[tuple[Lift, YardPlace]]]:
    """Return what stands in each rack, in the order of the lifts."""
    racks: dict[tuple[int, int], list[tuple[Lift, YardPlace]]] = {}
    for lift in sorted(lifts, key=lambda lift: lift.order):
        if lift.place is not None and (key := rack_of(lift)) is not None:
            racks.setdefault(key, []).append((lift, lift.place))
    return racks


def check_racks(check: Check, site: Site, lifts: Collection[Lift]) -> None:
    """Check every rack of every delivery, and that nothing stands in or too near to its frame."""
    check.look(True, "")
    frames: dict[tuple[int, int], Span] = {}
    for key, members in _racks(lifts).items():
        name = f"rack {key[1]} of delivery {key[0] + 1}"
        if site.rules.yard is None or site.rules.yard.rack_parts < 1:
            check.look(False, f"{name}: the site's rules have no racks")
            continue
        _check_walls(check, site, name, members)
        frames[key] = _frame(site, members)
        _check_frame(check, site, name, frames[key])
    gap_m, size_m = 0.0 if site.rules.yard is None else site.rules.yard.gap_m, site.frame.voxel_size_m
    for key, frame in frames.items():
        others = [
            (site.components[lift.component].label, _span(lift.place))
            for lift in lifts
            if lift.place is not None and lift.place.delivery == key[0] and rack_of(lift) != key
        ]
        others += [(f"rack {one[1]}", span) for one, span in frames.items() if one[0] == key[0] and one != key]
        for other, span in others:
            apart_m = _apart_vox(frame, span) * size_m
            check.look(
                apart_m >= gap_m - _EPS,
                f"rack {key[1]} of delivery {key[0] + 1}: its frame is {apart_m:.2f} m from {other} on plan; people "
                f"need {gap_m:g} m",
            )


def _check_walls(check: Check, site: Site, name: str, members: list[tuple[Lift, YardPlace]]) -> None:
    """Check what stands in a rack, in the order of the lifts."""
    rules, size_m = site.rules.yard, site.frame.voxel_size_m
    assert rules is not None
    check.look(len(members) <= rules.rack_parts, f"{name}: has {len(members)} walls, more than {rules.rack_parts}")
    for lift, place in members:
        part = site.components[lift.component]
        fault = _unfit(site, part, place)
        check.look(not fault, f"{name}: {part.label} {fault}")
    side = 1 if members[0][1].rack > 0 else -1
    axis = _thin_axis(members[0][1])
    for _, place in members:
        check.look((place.rack > 0) == (side > 0), f"{name}: its walls disagree on which side the frame is")
        check.look(_thin_axis(place) == axis, f"{name}: its walls are not parallel")
    wanted = max(1, whole_cells(rules.dunnage_m, site.frame))
    for (outer, before), (inner, after) in pairwise(members):
        first, second = site.components[outer.component].label, site.components[inner.component].label
        (low, high), (next_low, next_high) = _span(before), _span(after)
        free_vox = int(next_low[axis] - high[axis] if side > 0 else low[axis] - next_high[axis]) - 1
        check.look(
            free_vox == wanted,
            f"{name}: {second} does not stand {wanted * size_m:.2f} m behind {first}, which is lifted before it",
        )
        along = 1 - axis
        common = min(high[along], next_high[along]) - max(low[along], next_low[along]) + 1
        shorter = min(high[along] - low[along], next_high[along] - next_low[along]) + 1
        check.look(2 * common >= shorter, f"{name}: {first} does not lean on {second}")


def _check_frame(check: Check, site: Site, name: str, frame: Span) -> None:
    """Check that the frame stands in the yard, in nothing fixed and in no part of the building."""
    (x0, y0), (x1, y1) = frame
    inside = x0 >= 0 and y0 >= 0 and x1 < site.shape[0] and y1 < site.shape[1]
    good = inside and bool(site.yard[x0 : x1 + 1, y0 : y1 + 1].all())
    check.look(good, f"{name}: its frame stands outside the yard")
    on_access = inside and site.access is not None and bool(site.access[x0 : x1 + 1, y0 : y1 + 1].any())
    check.look(not on_access, f"{name}: its frame stands on the access of trucks")
    floor = 1 + int(site.ground_vox[x0 : x1 + 1, y0 : y1 + 1].max(initial=0)) if inside else 1
    head = whole_cells(_HEAD_M, site.frame)
    fixed = [(one.id, one.cells) for one in site.blockers if one.kind in ("structure", "crane")]
    fixed += [(one.label, one.shape.cells + np.array(one.target_vox, np.int32)) for one in site.components]
    for other, cells in fixed:
        low, high = np.array([x0, y0, floor]), np.array([x1, y1, floor + head - 1])
        check.look(not ((cells >= low) & (cells <= high)).all(axis=1).any(), f"{name}: its frame stands in {other}")


def _frame(site: Site, members: list[tuple[Lift, YardPlace]]) -> Span:
    """Return the columns of a rack's frame: behind the wall that is lifted last, as long as all of them."""
    rules = site.rules.yard
    assert rules is not None
    axis, side = _thin_axis(members[0][1]), members[0][1].rack
    heights_m = [
        np.ptp(part.mesh.vertices_m[np.unique(part.mesh.faces), 2])
        for part in (site.components[lift.component] for lift, _ in members)
    ]
    deep = max(1, whole_cells(rules.rack_depth * float(max(heights_m)), site.frame))
    spans = [_span(place) for _, place in members]
    low, high = np.min([one[0] for one in spans], axis=0), np.max([one[1] for one in spans], axis=0)
    last_low, last_high = spans[-1]
    if side > 0:
        low[axis], high[axis] = last_high[axis] + 1, last_high[axis] + deep
    else:
        low[axis], high[axis] = last_low[axis] - deep, last_low[axis] - 1
    return low, high


def _unfit(site: Site, part: Component, place: YardPlace) -> str:
    """Return why a part may not stand in a rack; empty if it may."""
    if part.start_vox is not None:
        return "has a place of its own in the site file"
    if place.pose is not StoredPose.AS_BUILT or part.erected:
        return "is upended, so it lies"
    if place.stack or place.cell_vox[2] != ground_under(site, place) + 1:
        return "does not stand on the ground"
    if kind_of(part) is not Work.WALL:
        return f"is not a wall, but a {kind_of(part).value}"
    return ""


def _thin_axis(place: YardPlace) -> int:
    low, high = _span(place)
    return 0 if high[0] - low[0] < high[1] - low[1] else 1


def _span(place: YardPlace) -> Span:
    low = np.array(place.cell_vox[:2], np.int64)
    return low, low + place.shape.cells[:, :2].max(axis=0)


def _apart_vox(one: Span, other: Span) -> float:
    """Return the shortest distance on plan between two rectangles, cells; below zero if they overlap."""
    free = np.maximum(one[0] - other[1], other[0] - one[1]) - 1
    return -1.0 if (free < 0).all() else float(np.hypot(*np.maximum(free, 0)))
