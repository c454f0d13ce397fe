"""A crane that moves: set-ups that serve nothing, and what carries the outriggers of the others."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import shapely

from bimvox.crane.ground import pad_loads_n
from bimvox.crane.tower_crane import TowerCrane
from bimvox.records.proof import Remark
from bimvox.remarks import table
from bimvox.remarks.subject import Subject, metres, name_of
from bimvox.site.areas import area_of
from bimvox.site.component import Component
from bimvox.site.crane_distances import EDGE_M, to_areas
from bimvox.site.lifting import hung_kg

_BELOW_M = 0.1
"""What ends no more than this above the foot of a crane is below it."""


def set_ups(subject: Subject) -> Iterator[Remark]:
    """Yield a remark about every set-up that serves nothing, or that is on the building or at an excavation."""
    site = subject.site
    if site.moving is None or not subject.motions:
        return
    used = dict(subject.stands())
    for number, (name, crane) in enumerate(zip(site.moving.names, site.cranes, strict=True)):
        if number not in used:
            yield table.SET_UP_UNUSED(name=name)
            continue
        there = used[number]
        load = _most_on_a_pad(there, number, crane)
        carrying = [name_of(part) for part in there.in_place if _is_below(part, crane)]
        if carrying:
            more = f" and {len(carrying) - 1:,} more" if len(carrying) > 1 else ""
            yield table.SET_UP_ON_BUILDING(crane=crane.name, first=carrying[0], more=more, load=load)
            continue  # what it stands on fills the excavation
        excavation = area_of(site, site.dug_m > 1e-6)
        for one in to_areas(crane, {"excavation": excavation}):
            if one.piece == "base" and one.distance_m < EDGE_M:
                distance, least = metres(one.distance_m), metres(EDGE_M)
                yield table.SET_UP_AT_EDGE(crane=crane.name, distance=distance, least=least, load=load)


def _is_below(part: Component, crane: TowerCrane) -> bool:
    """Return whether a part reaches below the square of outriggers, and does not end above their feet."""
    (low, high), (x, y, foot_m) = part.mesh.bounds_m, crane.base_m
    half_m = crane.mast_size_m / 2.0
    beside = (low[:2] > [x + half_m, y + half_m]).any() or (high[:2] < [x - half_m, y - half_m]).any()
    if beside or low[2] > foot_m - _BELOW_M:
        return False
    square = shapely.box(x - half_m, y - half_m, x + half_m, y + half_m)
    top = part.mesh.triangles_m[part.mesh.triangles_m[:, :, 2].max(axis=1) <= foot_m + _BELOW_M][:, :, :2]
    return bool(len(top)) and bool(shapely.intersects(square, shapely.convex_hull(shapely.linestrings(top))).any())


def _most_on_a_pad(there: Subject, number: int, crane: TowerCrane) -> str:
    """Return the largest load on an outrigger during the lifts of a set-up, in words."""
    most_n = 0.0
    for motion in there.motions if crane.carrier is not None and crane.luffing is not None else ():
        if motion.crane != number:
            continue
        axes = np.concatenate([motion.raising.axes, motion.loaded.axes])
        hung = hung_kg(crane, there.site.components[motion.component])
        assert crane.carrier is not None and crane.luffing is not None
        found = pad_loads_n(crane.carrier, crane.luffing, axes[:, 0], axes[:, 1], hung)
        most_n = max(most_n, 0.0 if found is None else float(found.max()))
    return f"up to {most_n / 1e3:,.0f} kN" if 0.0 < most_n < np.inf else "an unknown load"
