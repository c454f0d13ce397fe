"""The proof of the yard and its deliveries: the slinger's gap, what lies on what, racks, and what fits onto a truck.

It knows nothing of how places were chosen: it reads each place from the log and measures cells and triangles.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.own_box import laid_flat_m, sizes_m
from bimvox.kept import kept
from bimvox.proof.crane.axes import most_permitted, shares_of_capacity
from bimvox.proof.moment import Thing, beside, stored_thing
from bimvox.proof.space import whole_cells
from bimvox.records.lift import Lift, YardPlace
from bimvox.records.proof import Check
from bimvox.site.component import Component, StoredPose
from bimvox.site.lifting import crane_for
from bimvox.site.site import GROUND_ID, Site
from bimvox.site.work import Work, kind_of
from bimvox.units import mass_text

_HEAD_M = 2.0
"""Up to this height above the ground, something is in the way of a person."""
_EPS = 1e-6
_INLOADER_M = (9.5, 1.5, 3.65)
"""A panel may stand between the wheels of an inloader instead (data sheets)."""


def check_gap(check: Check, site: Site, lift: Lift, present: Sequence[Thing], rack: Collection[str] = ()) -> None:
    """Check that the slinger can walk around a part when it is picked.

    What its own stack or rack consists of does not count, nor do obstructions, which come and go, nor other parts whose
    place the site file gives, if it gives this part's too. ``rack``: the ids of the parts in its rack.
    """
    rules, place = site.rules.yard, lift.place
    if rules is None or place is None or place.cell_vox[2] < 1:
        return
    floor = _ground_under(site, place) + 1
    component = site.components[lift.component]
    frame, gap_m = site.frame, rules.gap_m
    own = stored_thing(site, lift, place)
    reach, head = whole_cells(gap_m, frame), whole_cells(_HEAD_M, frame)
    low = [own.low[0] - reach, own.low[1] - reach, floor]
    high = [own.high[0] + reach, own.high[1] + reach, floor + head - 1]
    exempt = {GROUND_ID, *rack} | {blocker.id for blocker in site.blockers if blocker.kind == "obstruction"}
    if component.start_vox is not None:
        exempt |= {other.id for other in site.components if other.start_vox is not None}
    columns = np.unique(own.cells[:, :2], axis=0)
    check.look(True, "")
    for thing in beside(present, low, high):
        if thing.name in exempt:
            continue
        cells = thing.cells[(thing.cells[:, 2] >= floor) & (thing.cells[:, 2] < floor + head)]
        if place.stack and len(cells) and _lies_under(own, thing):
            continue
        apart_m = _apart_vox(columns, cells[:, :2]) * frame.voxel_size_m
        check.look(
            apart_m >= gap_m - _EPS,
            f"{component.label}: when it is picked, {thing.name} is {apart_m:.2f} m away on plan; the slinger needs "
            f"{gap_m:g} m",
        )


def check_last_in(check: Check, site: Site, lift: Lift, present: Sequence[Thing]) -> None:
    """Check that nothing lies on a part when it is picked."""
    place = lift.place
    if site.rules.yard is None or place is None:
        return
    own = stored_thing(site, lift, place)
    low, high = [own.low[0], own.low[1], own.high[2] + 1], [own.high[0], own.high[1], site.shape[2]]
    stored = {one.id for one in site.components}
    columns = {tuple(column) for column in np.unique(own.cells[:, :2], axis=0).tolist()}
    names = [
        thing.name
        for thing in beside(present, low, high)
        if thing.name in stored
        and any(tuple(cell[:2]) in columns for cell in thing.cells[thing.cells[:, 2] > own.high[2]].tolist())
    ]
    check.look(
        not names, f"{site.components[lift.component].label}: {', '.join(names[:1])} lies on it when it is picked"
    )


def check_unloading(check: Check, site: Site, lift: Lift) -> None:
    """Check that no part lies on the access of trucks, and that the crane carries the part over a truck there.

    The crane's reach, its permitted share of the load chart and zones closed to the hook count. A truck stands wherever
    the hook is over the middle of a column of the access.
    """
    component, place = site.components[lift.component], lift.place
    crane = site.crane_of(component)
    if site.access is None or place is None:
        return
    columns = np.unique(place.shape.cells[:, :2] + np.array(place.cell_vox[:2]), axis=0)
    check.look(not site.access[tuple(columns.T)].any(), f"{component.label}: lies on the access of trucks")
    if crane is None:
        return
    crane = crane_for(site, crane, component)
    open_to_hook = site.access if site.prohibited is None else site.access & ~site.prohibited
    at_m = np.array(site.frame.origin_m[:2]) + (np.argwhere(open_to_hook) + 0.5) * site.frame.voxel_size_m
    at_m += np.array(component.hook_aside_vox) * site.frame.voxel_size_m
    from_axis_m = at_m - np.array(crane.base_m[:2])
    radius_m, slew_rad = np.hypot(*from_axis_m.T), np.arctan2(from_axis_m[:, 1], from_axis_m[:, 0])
    used = shares_of_capacity(
        crane, slew_rad, radius_m, component.mass_kg + crane.rigging_mass_kg + crane.hook_block_kg
    )
    in_reach = (radius_m >= crane.min_radius_m - _EPS) & (radius_m <= crane.jib_length_m + _EPS)
    check.look(
        bool((in_reach & (used <= most_permitted(site, [1.0]) + _EPS)).any()),
        f"{component.label}: cannot be unloaded, {crane.name} does not carry it over any truck on the access",
    )


def check_truck(check: Check, site: Site, number: int, lifts: Sequence[Lift]) -> None:
    """Check that the parts of a delivery fit onto its lorries: their mass, and a bed or an inloader with room for them.

    A single part may be heavier; a part that fits neither comes by a special transport. Where the rules limit no mass,
    there is no lorry.
    """
    rules, most_kg = site.rules, site.rules.truckload_kg
    if most_kg <= 0.0:
        return
    parts = [site.components[lift.component] for lift in sorted(lifts, key=lambda lift: lift.order)]
    if rules.yard is not None and rules.yard.lorries > 1:
        beds_m = [] if rules.yard.truck_m is None else [np.array(rules.yard.truck_m), np.array(_INLOADER_M)]
        needed = _lorries(parts, most_kg, beds_m, rules.yard.dunnage_m)
        check.look(
            needed <= rules.yard.lorries,
            f"delivery {number} needs {needed} lorries, more than the {rules.yard.lorries} of a delivery",
        )
        return
    mass_kg = sum(part.mass_kg for part in parts)
    check.look(
        len(parts) == 1 or mass_kg <= most_kg + _EPS,
        f"delivery {number} weighs {mass_text(mass_kg)}, more than the {mass_text(most_kg)} of a truckload",
    )
    if rules.yard is None or rules.yard.truck_m is None:
        return
    vehicles, dunnage_m = (rules.yard.truck_m, _INLOADER_M), rules.yard.dunnage_m
    loaded = [part for part in parts if any(_has_room([part], np.array(bed_m), dunnage_m) for bed_m in vehicles)]
    size = " x ".join(f"{one:g}" for one in rules.yard.truck_m)
    check.look(
        not loaded or any(_has_room(loaded, np.array(bed_m), dunnage_m) for bed_m in vehicles),
        f"delivery {number}: its {len(loaded)} parts do not fit onto a truck of {size} m",
    )


def _lorries(
    parts: Sequence[Component], most_kg: float, beds_m: Sequence[NDArray[np.float64]], dunnage_m: float
) -> int:
    """Return how many lorries bring parts, in the order of their lifts.

    The smallest bed that takes a part alone is its own: a flat one, an inloader, or a special transport, which only its
    mass fills. Panels have lorries of their own. A part goes onto the last lorry of its bed and sort; a panel that has
    no room there onto the last one with panels of another bed, if all fit onto one bed, then onto those of its own
    and of larger beds that bring other parts; otherwise onto a new lorry.
    """
    special = len(beds_m)
    lorries: list[tuple[tuple[int, bool], list[Component]]] = []  # bed and sort of the first part, and all

    def fit(bed: int, load: list[Component]) -> bool:
        return bed == special or _has_room(load, beds_m[bed], dunnage_m)

    for part in parts:
        own = min((bed for bed in range(special) if fit(bed, [part])), default=special)
        is_panel = own < special and kind_of(part) is Work.WALL
        sorts = [(own, is_panel)]
        if is_panel:
            sorts += [(n, True) for n in range(special) if n != own] + [(n, False) for n in range(own, special + 1)]
        for bed, panels in sorts:
            load = next((found for sort, found in reversed(lorries) if sort == (bed, panels)), None)
            if load is None or sum(one.mass_kg for one in load) + part.mass_kg > most_kg + _EPS:
                continue
            if any(fit(one, [*load, part]) for one in (range(special) if panels else (bed,))):
                load.append(part)
                break
        else:
            lorries.append((sorts[0], [part]))
    return len(lorries)


def _has_room(parts: Sequence[Component], bed_m: NDArray[np.float64], dunnage_m: float) -> bool:
    """Return whether parts fit on a bed in the order of their lifts: in rows, the rows in layers, as on every truck.

    Each lies flat with its longest edge along the bed, also what slopes in the building; a wall, or what does not fit
    so, stands on its longest edge. What fits no such way lies as it is in the building.
    """
    corner, row, layer_m = np.zeros(3), np.zeros(2), 0.0  # where the row begins; its length and width
    for part in parts:
        ways = []
        for length_m, width_m, height_m in (laid_flat_m(part.mesh), sizes_m(part.mesh)):
            lying, on_edge = np.array([length_m, width_m, height_m]), np.array([length_m, height_m, width_m])
            ways += [on_edge, lying] if kind_of(part) is Work.WALL else [lying, on_edge]
        fitting = [way for way in ways if (way <= bed_m + _EPS).all()]
        if not fitting:
            return False
        box = fitting[0]
        high_m = max(layer_m, float(box[2]))
        if (corner + np.array([row[0] + box[0], max(row[1], box[1]), high_m]) <= bed_m + _EPS).all():
            row, layer_m = np.array([row[0] + box[0], max(row[1], box[1])]), high_m
        elif (corner + np.array([box[0], row[1] + box[1], high_m]) <= bed_m + _EPS).all():
            corner[1] += row[1]
            row, layer_m = box[:2], high_m
        else:
            corner = np.array([0.0, 0.0, corner[2] + layer_m + dunnage_m])
            row, layer_m = box[:2], float(box[2])
            if (corner + box > bed_m + _EPS).any():
                return False
    return True


def check_stacks(check: Check, site: Site, lifts: Collection[Lift]) -> None:
    """Check every stack of every delivery: what it consists of, its limits, and that each part lies on the next."""
    rules = site.rules.yard
    stacks: dict[tuple[int, int], list[tuple[Lift, YardPlace]]] = {}
    for lift in lifts:
        place = lift.place
        if place is None:
            continue
        name = site.components[lift.component].label
        if place.stack:
            stacks.setdefault((place.delivery, place.stack), []).append((lift, place))
        else:
            check.look(
                stands_on_something(site, place),
                f"{name}: lies neither on the ground, nor in a stack or on structure",
            )
    for (delivery, number), members in stacks.items():
        if rules is None:
            check.look(False, f"stack {number} of delivery {delivery + 1}: the site's rules have no stacks")
            continue
        _check_stack(check, site, f"stack {number} of delivery {delivery + 1}", members)


def stands_on_something(site: Site, place: YardPlace) -> bool:
    """Return whether a stored part lies on the ground, or wholly on structure, such as a truck in the model."""
    below = place.shape.cells[place.shape.cells[:, 2] == 0] + np.array(place.cell_vox) - np.array([0, 0, 1])
    if (below < 0).any() or (below >= site.shape).any():
        return False
    return bool(_firm_cells(site)[tuple(below.T)].all())


@kept
def _firm_cells(site: Site) -> NDArray[np.bool_]:
    """Return (X, Y, Z) whether ground or structure is there."""
    firm = np.zeros(site.shape, np.bool_)
    for blocker in site.blockers:
        if blocker.kind in ("ground", "structure"):
            firm[tuple(blocker.cells.T)] = True
    return firm


def _ground_under(site: Site, place: YardPlace) -> int:
    """Return the highest layer of the ground under a stored part; -1 if it lies outside the site."""
    columns = place.shape.cells[:, :2] + np.array(place.cell_vox[:2], np.int32)
    inside = ((columns >= 0) & (columns < site.shape[:2])).all(axis=1)
    return int(site.ground_vox[tuple(columns[inside].T)].max(initial=-1))


def _check_stack(check: Check, site: Site, name: str, members: list[tuple[Lift, YardPlace]]) -> None:
    """Check one stack, from the ground up."""
    rules, size_m = site.rules.yard, site.frame.voxel_size_m
    assert rules is not None
    members = sorted(members, key=lambda one: one[1].cell_vox[2])
    parts = [site.components[lift.component] for lift, _ in members]
    for part, (_, place) in zip(parts, members, strict=True):
        fault = _unfit(part, place)
        check.look(not fault, f"{name}: {part.label} {fault}")
    check.look(len(parts) <= rules.stack_parts, f"{name}: has {len(parts)} parts, more than {rules.stack_parts}")
    mass_kg = sum(part.mass_kg for part in parts)
    check.look(
        mass_kg <= rules.stack_kg + _EPS, f"{name}: weighs {mass_text(mass_kg)}, more than {mass_text(rules.stack_kg)}"
    )
    extents_m = [np.ptp(part.mesh.vertices_m[np.unique(part.mesh.faces)], axis=0) for part in parts]
    height_m = float(sum(extent[2] for extent in extents_m)) + (len(parts) - 1) * rules.dunnage_m
    most_m = min(rules.stack_height_m, float(extents_m[0][:2].min()))
    check.look(height_m <= most_m + _EPS, f"{name}: is {height_m:.2f} m high, more than {most_m:.2f} m")
    lowest = members[0][1]
    check.look(lowest.cell_vox[2] == _ground_under(site, lowest) + 1, f"{name}: does not stand on the ground")
    for (under, below), (over, above) in pairwise(members):
        lower, upper = site.components[under.component].label, site.components[over.component].label
        free_vox = above.cell_vox[2] - below.cell_vox[2] - int(below.shape.cells[:, 2].max()) - 1
        wanted = max(1, whole_cells(rules.dunnage_m, site.frame))
        check.look(
            free_vox == wanted,
            f"{name}: {upper} is {free_vox * size_m:.2f} m above {lower}; the dunnage is {wanted * size_m:.2f} m thick",
        )
        (low, high), (first, last) = _outline(below), _outline(above)
        inside = (first >= low).all() and (last <= high).all()
        check.look(bool(inside), f"{name}: {upper} overhangs {lower}, which it lies on")
        check.look(over.order < under.order, f"{name}: {upper} lies on {lower}, but is lifted later")


def _unfit(part: Component, place: YardPlace) -> str:
    """Return why a part may not be in a stack; empty if it may."""
    if part.start_vox is not None:
        return "has a place of its own in the site file"
    if place.pose is not StoredPose.AS_BUILT or part.erected:
        return "is upended, so it may not lie in a stack"
    size = np.ptp(part.shape.cells, axis=0) + 1
    if len(part.shape.cells) != int(np.prod(size)):
        return "does not fill its box, so it gives no level bearing"
    if kind_of(part) not in (Work.SLAB, Work.BEAM):
        return f"is neither a slab nor a beam, but a {kind_of(part).value}"
    return ""


def _outline(place: YardPlace) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the first and last column of a stored part's box."""
    low = np.array(place.cell_vox[:2], np.int64)
    return low, low + place.shape.cells[:, :2].max(axis=0)


def _lies_under(own: Thing, thing: Thing) -> bool:
    """Return whether a thing is entirely below a part, and meets its outline."""
    meets = all(thing.low[axis] <= own.high[axis] and thing.high[axis] >= own.low[axis] for axis in (0, 1))
    return meets and thing.high[2] < own.low[2]


def _apart_vox(columns: NDArray[np.int32], others: NDArray[np.int32]) -> float:
    """Return the shortest distance on plan between two sets of columns, cells; inf if one is empty."""
    if not len(columns) or not len(others):
        return float("inf")
    low, high = columns.min(axis=0), columns.max(axis=0)
    others = np.unique(others, axis=0)
    outside = np.maximum(np.maximum(low - others - 1, others - high - 1), 0)
    near = others[np.hypot(*outside.T) <= np.hypot(*outside.T).min() + np.hypot(*(high - low + 1))]
    free = np.maximum(np.abs(columns[:, None] - near[None]) - 1, 0)
    touching = (np.abs(columns[:, None] - near[None]) == 0).all(axis=2)
    return 0.0 if touching.any() else float(np.hypot(free[..., 0], free[..., 1]).min())


Span = tuple[NDArray[np.int64], NDArray[np.int64]]
"""First and last column of a rectangle, both inclusive."""


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
            apart_m = _racks_apart_vox(frame, span) * size_m
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
        fault = _unfit_racks(site, part, place)
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


def _unfit_racks(site: Site, part: Component, place: YardPlace) -> str:
    """Return why a part may not stand in a rack; empty if it may."""
    if part.start_vox is not None:
        return "has a place of its own in the site file"
    if place.pose is not StoredPose.AS_BUILT or part.erected:
        return "is upended, so it lies"
    if place.stack or place.cell_vox[2] != _ground_under(site, place) + 1:
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


def _racks_apart_vox(one: Span, other: Span) -> float:
    """Return the shortest distance on plan between two rectangles, cells; below zero if they overlap."""
    free = np.maximum(one[0] - other[1], other[0] - one[1]) - 1
    return -1.0 if (free < 0).all() else float(np.hypot(*np.maximum(free, 0)))
