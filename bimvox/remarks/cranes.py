"""Cranes to look at: invented ones, ones inside the building, low carries and high utilisation."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from shapely import MultiPoint, box

from bimvox.bim.building import ASSUMED
from bimvox.bim.kinds.kind import Confidence, Kind
from bimvox.bim.kinds.words import density_of_kind
from bimvox.compiled import kernel
from bimvox.crane.kinematics import raised
from bimvox.crane.load_chart import utilisation
from bimvox.crane.machine import Machine, differences, does_more, is_same, same_chart
from bimvox.crane.outline import mast_box_m
from bimvox.crane.tower_crane import TowerCrane
from bimvox.grid.frame import GridFrame
from bimvox.motion.figures import capacity_used
from bimvox.motion.swept import cells_of_axes, load_frame
from bimvox.records.motion import LiftMotion, PhaseName, by_each_crane
from bimvox.records.proof import Remark
from bimvox.remarks import table
from bimvox.remarks.subject import Subject, metres, name_of, tonnes
from bimvox.site.areas import area_of
from bimvox.site.catalogue import FICTITIOUS, catalogue, machine_called
from bimvox.site.component import Component
from bimvox.site.crane_distances import EDGE_M, STANDING_M, TRAPPED_M, base_of, of_crane, to_areas
from bimvox.site.crane_room import HEADROOM_M, PLACE_M, REACH_M, WAY_M, Room, place_beside, way_among, way_in
from bimvox.site.lifting import crane_for, crane_towards, hung_kg, place_radius_m
from bimvox.site.site import Site
from bimvox.site.tandem import part_on

SCALED = " scaled "
"""In the names of machines that do not exist; earlier versions did not call them fictitious."""
LARGEST_TM = 10_000.0
"""Load moment of the largest tower crane ever built (Kroll K-10000: 120 t at 82 m)."""


def machines(subject: Subject) -> Iterator[Remark]:
    """Yield remarks about cranes that are not machines of the catalogue, and what differs by how much."""
    for crane in subject.site.cranes:
        described = crane
        if crane.kind == "mobile":  # the catalogue's are at z = 0; of one that the site file describes heights are, too
            crane = raised(crane, -crane.base_m[2])
        named = machine_called(crane.machine or crane.name)
        possible = catalogue() if named is None else (named,)
        if named is not None and named.sources:
            yield _public(crane, named)
        entries = [entry for machine in possible for entry in machine.cranes]
        if any(is_same(crane, entry) or is_same(described, entry) for entry in entries):
            if named is None or not named.sources:
                yield table.CRANE_GENERIC(crane=crane.name)
            continue
        entry = _entry_of(crane, named)
        yield _unknown(crane) if entry is None else _altered(crane, entry)


def _public(crane: TowerCrane, machine: Machine) -> Remark:
    """Return the remark about a real machine from public figures."""
    return table.CRANE_PUBLIC(
        crane=crane.name,
        machine=machine.name,
        source="; ".join(f"{one.title}, {one.publisher}{one.date and ', ' + one.date}" for one in machine.sources),
        like=machine.like,
        assumed=", ".join(machine.assumed),
        not_found=", ".join(machine.not_found),
    )


def _entry_of(crane: TowerCrane, named: Machine | None) -> TowerCrane | None:
    """Return the entry of a crane's machine with its jib, or the longest, and its falls, or those that carry most.

    For a name of its own: the entry that has its load chart, as far as its jib reaches.
    """
    if named is None:
        entries = (entry for machine in catalogue() for entry in (machine.usual, *machine.cranes))
        return next((e for e in entries if e.kind == crane.kind and same_chart(crane.chart, e.chart)), None)
    entries_of_jib = named.with_jib(crane.jib_own_m) or named.with_jib(max(named.lengths_m))
    return next((entry for entry in entries_of_jib if entry.falls == crane.falls), entries_of_jib[-1])


def _unknown(crane: TowerCrane) -> Remark:
    """Return the remark about a crane that no entry of the catalogue describes."""
    radii, carries = np.array(crane.chart.radius_m), np.array(crane.chart.capacity_kg)
    moment_tm = float((radii * carries).max()) / 1000.0
    data = (
        f"{tonnes(float(carries[0]))} up to {radii[0]:g} m, {tonnes(float(carries[-1]))} at {radii[-1]:g} m, "
        f"jib {crane.jib_length_m:g} m"
    )
    if crane.name.startswith(FICTITIOUS) or SCALED in crane.name:
        return table.CRANE_FICTITIOUS(crane=crane.name, data=data)
    if moment_tm > LARGEST_TM:
        return table.CRANE_TOO_LARGE(crane=crane.name, moment=moment_tm, data=data)
    if crane.overrides:
        data += f"; the site file changes the machine {crane.machine or crane.name!r}: {_listed(crane.overrides)}"
    return table.CRANE_UNKNOWN(crane=crane.name, data=data)


def _altered(crane: TowerCrane, entry: TowerCrane) -> Remark:
    """Return the remark about a crane that differs from its entry; serious if it carries or reaches more."""
    known = "as the catalogue has it" if crane.name == entry.name else f"{entry.name!r} of the catalogue"
    declared = ", as its [crane.override] says" if crane.overrides else ""
    altered = table.CRANE_DOES_MORE if does_more(crane, entry) else table.CRANE_ALTERED
    return altered(crane=crane.name, known=known, declared=declared, differences=_listed(differences(crane, entry)))


def _listed(found: tuple[object, ...]) -> str:
    return "; ".join(map(str, found))


_LEVEL_M = 0.5


def crane_feet(subject: Subject) -> Iterator[Remark]:
    """Yield a remark about every crane whose mast goes through something, or stands in the building's outline."""
    site = subject.site
    for number, there in subject.stands():
        crane = site.cranes[number]
        low, high = np.array(mast_box_m(crane))
        met = [
            name_of(component)
            for component in there.in_place
            if _meets(component.shape.boxes + np.tile(component.target_vox, 2), site.frame, low, high)
        ]
        for blocker in site.blockers:
            if blocker.kind in ("structure", "obstruction"):
                cells = np.concatenate([blocker.cells, blocker.cells + 1], axis=1)
                if _meets(cells, site.frame, low, high):
                    met.append(blocker.name or blocker.id)
        if met:
            more = f" and {len(met) - 1:,} more" if len(met) > 1 else ""
            yield table.MAST_MEETS(crane=crane.name, first=met[0], more=more)
        elif abs(off_m := low[2] - _ground_m(site, low, high)) > _LEVEL_M:
            yield table.FOOT_OFF(crane=crane.name, off=abs(off_m), where="above" if off_m > 0.0 else "below")
        elif site.moving is None and _stands_in(subject, low, high):
            yield table.FOOT_INSIDE(crane=crane.name)


def _ground_m(site: Site, low: NDArray[np.float64], high: NDArray[np.float64]) -> float:
    """Return the height of the lowest ground under a mast; that of its foot outside the site."""
    first, last = np.clip(site.frame.cells_over(low, high), 0, site.shape)
    tops = site.ground_vox[first[0] : last[0], first[1] : last[1]]
    return site.frame.origin_m[2] + site.frame.voxel_size_m * (int(tops.min()) + 1) if tops.size else float(low[2])


def _meets(boxes_vox: NDArray[np.int32], frame: GridFrame, low: NDArray[np.float64], high: NDArray[np.float64]) -> bool:
    """Return whether any of (N, 6) boxes of cells reaches more than half a cell into a mast."""
    origin, size = np.array(frame.origin_m), frame.voxel_size_m
    first, last = origin + size * boxes_vox[:, :3], origin + size * boxes_vox[:, 3:]
    shared = np.minimum(last, high) - np.maximum(first, low)
    return bool((shared > size / 2.0).all(axis=1).any())


def _stands_in(subject: Subject, low: NDArray[np.float64], high: NDArray[np.float64]) -> bool:
    """Return whether a mast stands completely within the convex outline of the parts on plan."""
    bounds = [component.mesh.bounds_m[:, :2] for component in subject.in_place]
    if not bounds:
        return False
    corners = np.concatenate([[a, b, (a[0], b[1]), (b[0], a[1])] for a, b in bounds])
    return bool(MultiPoint(corners).convex_hull.contains(box(*low[:2], *high[:2])))


def tails(subject: Subject) -> Iterator[Remark]:
    """Yield a remark about every crane whose counterweight passes something too near, and of outriggers at an edge."""
    site = subject.site
    excavation = area_of(site, site.dug_m > 1e-6)
    for number, there in subject.stands():
        crane = site.cranes[number]
        near = of_crane(crane, there.things, STANDING_M)
        trapping = [one for one in near if one.piece == "tail" and one.distance_m < TRAPPED_M - 1e-6]
        low = [one for one in near if one.piece == "below tail" and one.kind != "stored"]
        if trapping:
            first = min(trapping, key=lambda one: (one.distance_m, one.kind))
            distance, least = metres(first.distance_m), metres(TRAPPED_M)
            yield table.TAIL_NEAR(crane=crane.name, name=first.name, distance=distance, least=least)
        elif low:
            first = min(low, key=lambda one: (one.distance_m, one.kind))
            yield table.TAIL_LOW(crane=crane.name, name=first.name, distance=metres(first.distance_m))
        if crane.kind == "mobile" and site.moving is None:
            for one in to_areas(crane, {"excavation": excavation}):
                if one.piece == "base" and one.distance_m < EDGE_M:
                    distance, least = metres(one.distance_m), metres(EDGE_M)
                    yield table.OUTRIGGER_EDGE(crane=crane.name, distance=distance, least=least)


def rooms(subject: Subject) -> Iterator[Remark]:
    """Yield a remark about every crane that cannot come to its place, or be dismantled or driven away from it."""
    site = subject.site
    if site.moving is not None:
        yield from _ways(subject)
        return
    for crane in site.cranes:
        if crane.kind != "mobile":
            if place_beside(site, crane, base_of(crane).edge_m, finished=True).room is Room.NONE:
                yield table.NO_PLACE(crane=crane.name, place=f"{PLACE_M:g}", way=f"{WAY_M:g}", reach=f"{REACH_M:g}")
            continue
        for finished, where, when in (
            (False, "to", "before the building stands"),
            (True, "from", "when the building stands"),
        ):
            if way_in(site, crane, finished=finished).room is Room.NONE:
                way, high = f"{WAY_M:g}", f"{HEADROOM_M:g}"
                yield table.NO_WAY(crane=crane.name, way=way, high=high, where=where, when=when)
                break


def _ways(subject: Subject) -> Iterator[Remark]:
    """Yield a remark about every set-up that a crane that moves cannot drive to, or away from."""
    site, way, high = subject.site, f"{WAY_M:g}", f"{HEADROOM_M:g}"
    for number, there in subject.stands():
        crane, own = site.cranes[number], [one.order for one in subject.motions if one.crane == number]
        before = [lift for lift in there.plan.lifts if own and lift.order < min(own) and lift.is_set]
        for parts, where, when in (
            ([site.components[lift.component] for lift in before], "to", "before its first lift there"),
            (there.in_place, "from", "after its last lift there"),
        ):
            if way_among(site, crane, parts).room is Room.NONE:
                yield table.NO_WAY(crane=crane.name, way=way, high=high, where=where, when=when)
                break


CARRYING_HEIGHT_M = 2.0
"""Least height over people and finished work: 2 to 3 m are usual in lift plans (professional judgement)."""
HIGH_SHARE = 0.9
"""Above this share of the capacity a lift is close to the limit: many contractors permit 80 to 90 % (professional
judgement; 29 CFR 1926.751 calls lifts from 75 % on critical)."""
DOUBTFUL_SHARE = 0.8
"""Above this share of the capacity, a mass that may be 25 % too low overloads the crane."""

_LIGHT = (Kind.TIMBER, Kind.LIGHT)
_ROUNDING_M = 0.051
_FAR_M = 10.0
_FREE = np.int32(2**31 - 1)


def carried_low(subject: Subject) -> Iterator[Remark]:
    """Yield a remark about every load that is carried over something with less than 2 m between them.

    The load counts while it travels, from the start of slewing or trolleying until it is only lowered. Parts that wait
    in the yard do not count, and neither do masts, which no load passes over.
    """
    for component, gap_m, below in _heights(subject, CARRYING_HEIGHT_M):
        if gap_m < CARRYING_HEIGHT_M - _ROUNDING_M:
            gap, least = metres(max(gap_m, 0.0)), metres(CARRYING_HEIGHT_M)
            yield table.CARRIED_LOW(component, gap=gap, below=below, least=least)


def least_height_m(subject: Subject) -> tuple[float, str, str] | None:
    """Return how low a load is carried at the lowest: the height, its part's name, and over what.

    It is measured as for ``carried_low``. None without a crane, or if every load is carried higher than 10 m.
    """
    heights = [(gap_m, name_of(component), below) for component, gap_m, below in _heights(subject, _FAR_M)]
    found = min(heights, default=(_FAR_M, "", ""))
    return (max(found[0], 0.0), *found[1:]) if found[0] < _FAR_M else None


def _heights(subject: Subject, most_m: float) -> Iterator[tuple[Component, float, str]]:
    """Yield every load, its least height over something while it travels, at most ``most_m``, and over what that is."""
    site = subject.site
    if not (subject.motions and site.cranes):
        return
    since = _since(subject)
    names = {lift.order: name_of(site.components[lift.component]) for lift in subject.lifts}
    for number, blocker in enumerate(site.blockers):
        names[-1 - number] = "the ground" if blocker.kind == "ground" else blocker.name or blocker.id
    reach = int(np.ceil(most_m / site.frame.voxel_size_m))
    for motion in subject.motions:
        component = part_on(site, motion.component, motion.crane)
        gap, below = _least_gap(since, _travelled(site, component, motion), _feet(component), motion.order, reach)
        yield component, float(gap) * site.frame.voxel_size_m, names.get(below, "")


def high_utilisation(subject: Subject) -> Iterator[Remark]:
    """Yield a remark about every lift that uses more of the crane's capacity than the default, which gives way.

    If the site file gives the limit, from 90 % on.
    """
    site = subject.site
    gives_way = "highest_utilisation" in site.rules.gives_way
    for component, crane, share in _used(subject):
        if share > (site.rules.highest_utilisation if gives_way else HIGH_SHARE) + 1e-6:
            set_by = crane_towards(site, crane, component, component.target_vox)
            at_place = utilisation(set_by.chart, place_radius_m(site, crane, component), hung_kg(crane, component))
            where = "at its place" if at_place > share - 1e-3 else "where it is picked"
            if gives_way:
                where += f", where it cannot use {100.0 * site.rules.highest_utilisation:g} %"
            yield table.HIGH_UTILISATION(component, share=100.0 * share, crane=crane.name, where=where)


def doubtful_mass(subject: Subject) -> Iterator[Remark]:
    """Yield a remark about every lift that the crane may not carry because its mass or its kind is an assumption."""
    for component, crane, share in _used(subject):
        unsure, heavier, judgement = component.mass_uncertainty, _if_concrete(component), component.judgement
        if share * heavier > 1.0 + 1e-9:
            mass, kind = tonnes(heavier * component.mass_kg), judgement.kind.value
            used = 100.0 * share * heavier
            yield table.IF_CONCRETE(component, kind=kind, why=judgement.why, mass=mass, share=used, crane=crane.name)
        elif share > DOUBTFUL_SHARE + 1e-9 and unsure >= ASSUMED:
            mass = tonnes(component.mass_kg)
            yield table.DOUBTFUL_MASS(
                component, share=100.0 * share, crane=crane.name, mass=mass, unsure=100.0 * unsure
            )


def _if_concrete(component: Component) -> float:
    """Return how many times as much a part weighs if the assumption about its kind is wrong and it is concrete."""
    judgement = component.judgement
    if judgement.confidence is not Confidence.ASSUMED or component.mass_source != "default":
        return 1.0
    return (
        max(density_of_kind(Kind.CONCRETE) / density_of_kind(judgement.kind), 1.0) if judgement.kind in _LIGHT else 1.0
    )


def _used(subject: Subject) -> Iterator[tuple[Component, TowerCrane, float]]:
    """Yield every lifted part, its crane, and the largest share of that crane's capacity that its lift uses."""
    site = subject.site
    for number, crane in enumerate(site.cranes):
        for motion in by_each_crane(subject.motions):
            if motion.crane == number:
                yield part_on(site, motion.component, number), crane, capacity_used(site, motion)


def _since(subject: Subject) -> NDArray[np.int32]:
    """Return (X, Y, Z) the order of the lift that fills a cell; below 0 if a fixed object always does."""
    site = subject.site
    since = np.full(site.shape, _FREE, np.int32)
    for lift in reversed(subject.lifts):
        component = site.components[lift.component]
        _fill(since, component.shape.cells, np.array(component.target_vox, np.int32), lift.order)
    for number, blocker in enumerate(site.blockers):
        if blocker.kind != "crane":
            _fill(since, blocker.cells, np.zeros(3, np.int32), -1 - number)
    return since


def _feet(component: Component) -> NDArray[np.int32]:
    """Return (N, 3) the lowest cell of every column of a part."""
    cells = component.shape.cells[np.lexsort(component.shape.cells.T[::-1])]
    first = np.ones(len(cells), np.bool_)
    first[1:] = (np.diff(cells[:, :2], axis=0) != 0).any(axis=1)
    return np.ascontiguousarray(cells[first])


def _travelled(site: Site, component: Component, motion: LiftMotion) -> NDArray[np.float64]:
    """Return (N, 3) the reference cells of a load at the samples of its travel."""
    crane = site.crane_of(component)
    assert crane is not None
    load = load_frame(crane_for(site, crane, component), site.frame, component.hook_line_vox)
    time_ns = motion.loaded.time_ns + np.int64(motion.start_ns)
    inside = np.zeros(len(time_ns), np.bool_)
    for phase in motion.phases:
        if phase.name is PhaseName.TRAVERSE:
            inside |= (time_ns >= phase.start_ns) & (time_ns <= phase.end_ns)
    return cells_of_axes(load, motion.loaded.axes[inside])


@kernel
def _fill(since: NDArray[np.int32], cells: NDArray[np.int32], at: NDArray[np.int32], value: int) -> None:
    """Write a value to cells; those outside the grid are ignored."""
    nx, ny, nz = since.shape
    for n in range(cells.shape[0]):
        x, y, z = cells[n, 0] + at[0], cells[n, 1] + at[1], cells[n, 2] + at[2]
        if 0 <= x < nx and 0 <= y < ny and 0 <= z < nz:
            since[x, y, z] = value


@kernel
def _least_gap(
    since: NDArray[np.int32], places: NDArray[np.float64], feet: NDArray[np.int32], own: int, reach: int
) -> tuple[float, int]:
    """Return the least height, in cells, of a load's feet over what is in place before a lift, and its number.

    The number is that in ``since``. A position between cells counts for the cells around it on plan. The height is
    ``reach`` if nothing is that near.
    """
    nx, ny, nz = since.shape
    least, below = float(reach), 0
    for n in range(places.shape[0]):
        for f in range(feet.shape[0]):
            foot = places[n, 2] + feet[f, 2]
            top = min(int(np.floor(foot + 1e-6)), nz)
            for corner in range(4):
                x = places[n, 0] + feet[f, 0]
                y = places[n, 1] + feet[f, 1]
                i = int(np.floor(x + 1e-6)) if corner // 2 == 0 else int(np.ceil(x - 1e-6))
                j = int(np.floor(y + 1e-6)) if corner % 2 == 0 else int(np.ceil(y - 1e-6))
                if i < 0 or j < 0 or i >= nx or j >= ny:
                    continue
                k = top - 1
                while k >= 0 and foot - (k + 1) < least - 1e-9:
                    if since[i, j, k] < own:
                        least, below = foot - (k + 1), since[i, j, k]
                        break
                    k -= 1
    return least, below
