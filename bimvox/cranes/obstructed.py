"""Lifts that another crane obstructs wherever its jib points: no time is looked for."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import NDArray

from bimvox.crane.conflict import (
    COLUMNS,
    HOOK_HIGH,
    HOOK_LOW,
    LOWEST,
    RADIUS_HIGH,
    RADIUS_LOW,
    SLEW_HIGH,
    SLEW_LOW,
    Conflict,
    clear_of_one,
    first_conflict,
    numbers_of,
)
from bimvox.crane.outline import outline_of
from bimvox.crane.reach import distances_m
from bimvox.crane.tower_crane import TowerCrane
from bimvox.cranes.clock import standing_at
from bimvox.cranes.lift import Carried, NoFreeTimeError
from bimvox.site.set_ups import LiftWork, slews
from bimvox.site.site import Site

_SECTORS = 8
_ANGLES = 72
"""Angles of a jib that are looked at for room beside straight ways."""
_FAR_M = 1e5
_NARROWEST_RAD = np.radians(0.05)
"""Half the sector that is not divided any more: the jib may be free there."""


def insist_on_room(site: Site, carried: Sequence[Carried]) -> None:
    """Raise an error if another crane obstructs lifts wherever it waits.

    Raises:
        NoFreeTimeError: With all such lifts.
    """
    found = list(always_obstructed(site, carried).items())
    if found:
        raise NoFreeTimeError(
            *found[0],
            hint="store the part elsewhere ([[component]] start), or put the cranes further apart or at other heights",
            more=dict(found[1:]),
        )


def always_obstructed(site: Site, carried: Sequence[Carried]) -> dict[str, str]:
    """Return ids of the components whose lifts another crane obstructs wherever it waits, and how it does.

    The other crane waits with its hook next to the mast and at the jib, where it obstructs least. Sectors of its jib
    are divided until the lift is free of it in the middle of one, or meets it so closely in the middle of each that it
    meets it in the whole sector: no point of the jib moves further than its radius times half the sector.

    Args:
        site: The site.
        carried: The lifts; a crane without any is not looked at.
    """
    at_work = sorted({one.crane for one in carried})
    found = {}
    for one in carried:
        for number in at_work:
            met = None if number == one.crane else _met_everywhere(site, one, number)
            if met is not None:
                own, other = site.cranes[one.crane].name, site.cranes[number].name
                found[site.components[one.lift.component].id] = (
                    f"{own} has no free time slot for it alongside the other cranes: wherever the jib of {other} "
                    f"points, the {met.parts[0]} of {own} would come within {met.distance_m:.1f} m of its "
                    f"{met.parts[1]}, {met.needed_m:g} m are needed"
                )
    return found


def _met_everywhere(site: Site, one: Carried, number: int) -> Conflict | None:
    """Return how a lift meets the other crane where that is latest; None if it may be free of it somewhere."""
    other = outline_of(site.cranes[number])
    outlines, separation_m = (outline_of(site.cranes[one.crane]), other), site.rules.crane_separation_m
    reach_m, (row,) = max(other.jib_end_m, other.tail_m), _waiting(site.cranes[number], np.zeros(1))
    half = np.pi / _SECTORS
    sectors = [((2 * n + 1) * half, half) for n in range(_SECTORS)]
    latest: Conflict | None = None
    while sectors:
        middle, half = sectors.pop()
        still = row.copy()
        still[[SLEW_LOW, SLEW_HIGH]] = middle
        met = first_conflict(outlines, one.track, standing_at(still, 0), separation_m)
        if met is None or half < _NARROWEST_RAD:
            return None
        latest = met if latest is None or met.time_ns > latest.time_ns else latest
        closer_m = separation_m - reach_m * half
        if closer_m < 0.0 or first_conflict(outlines, one.track, standing_at(still, 0), closer_m) is None:
            sectors += [(middle - half / 2.0, half / 2.0), (middle + half / 2.0, half / 2.0)]
    return latest


def _waiting(crane: TowerCrane, slew_rad: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (M, 9) rows of a crane that waits at (M,) angles with its hook at the jib and next to the mast."""
    rows = np.zeros((len(slew_rad), COLUMNS))
    rows[:, SLEW_LOW] = rows[:, SLEW_HIGH] = slew_rad
    rows[:, [RADIUS_LOW, RADIUS_HIGH]] = crane.min_radius_m
    rows[:, [LOWEST, HOOK_LOW, HOOK_HIGH]] = outline_of(crane).rope_top_m
    return rows


def clear_ways(cranes: tuple[TowerCrane, TowerCrane], work: LiftWork, separation_m: float) -> NDArray[np.bool_]:
    """Return (N, 2) whether each crane, with each part on the way from the yard, is clear of the other.

    It picks in the middle of where the part lies within the yard, nearer to it than to the other if it can. That one
    waits with its hook at the jib and next to the mast, at whatever angle leaves room.
    """
    outlines = [numbers_of(outline_of(crane)) for crane in cranes]
    clear = np.zeros((len(work.masses_kg), 2), np.bool_)
    bases_m = np.array([crane.base_m[:2] for crane in cranes])
    for own, other in ((0, 1), (1, 0)):
        picks_m = _picks_m(work, bases_m[own], bases_m[other])
        waits = _waiting(cranes[other], 2.0 * np.pi * np.arange(_ANGLES) / _ANGLES)
        base_m = bases_m[[own]]
        slew = [slews(base_m, end_m)[0] for end_m in (work.places_m, picks_m)]
        radius_m = np.stack([distances_m(base_m, end_m)[0] for end_m in (work.places_m, picks_m)])
        turn = np.remainder(slew[1] - slew[0] + np.pi, 2.0 * np.pi) - np.pi
        over = np.zeros((len(turn), COLUMNS))
        over[:, SLEW_LOW], over[:, SLEW_HIGH] = slew[0] + np.minimum(turn, 0.0), slew[0] + np.maximum(turn, 0.0)
        over[:, RADIUS_LOW], over[:, RADIUS_HIGH] = radius_m.min(axis=0), radius_m.max(axis=0)
        over[:, LOWEST] = work.tops_m - work.heights_m
        over[:, HOOK_LOW] = over[:, HOOK_HIGH] = work.tops_m + cranes[own].sling_m
        clear[:, own] = clear_of_one(outlines[own], over, outlines[other], waits, separation_m)
    return clear


def _picks_m(work: LiftWork, own_m: NDArray[np.float64], other_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (N, 2) about where a crane on a base picks each part: nearer to it than to the other, if it lies there."""
    towards = (own_m - other_m) / max(float(np.hypot(*(own_m - other_m))), 1e-9)
    aside, middle_m = _FAR_M * np.array([-towards[1], towards[0]]), 0.5 * (own_m + other_m)
    edge_m = (middle_m - aside, middle_m + aside)
    nearer = shapely.Polygon([*edge_m, *(end_m + _FAR_M * towards for end_m in edge_m[::-1])])
    rooms = np.where(shapely.is_empty(work.rooms[:, 0]), work.rooms[:, 1], work.rooms[:, 0])
    parts = shapely.intersection(rooms, nearer)
    middles = shapely.centroid(np.where(shapely.is_empty(parts), rooms, parts))
    found = np.stack([shapely.get_x(middles), shapely.get_y(middles)], axis=1)
    # Where a part lies in the yard may not be asked, and it may be larger than the yard.
    otherwise_m = work.yard_m.mean(axis=0) if len(work.yard_m) else work.places_m
    picks_m: NDArray[np.float64] = np.where(np.isnan(found), otherwise_m, found)
    return picks_m
