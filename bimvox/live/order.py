"""Which lifts of a plan may change places: what the proof of the plan says about another order.

The plan proves each lift with the parts before it in their places and the others in the yard. In another order, a lift
meets a part that the plan had elsewhere. It stays proven if its footprint (all cells that its proof checked) has no
cell of that part, wherever it is then. Otherwise the two keep the plan's order, and so do lifts of which one must come
before the other, or which come with different deliveries. Clearances in transit that give way, give way here too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bimvox.live.other_ways import LiftWay
from bimvox.planning.order.graph import order_graph
from bimvox.planning.preparation import Preparation
from bimvox.proof.footprint import CellMask, Footprint, MotionFootprint, motion_footprint, path_footprint
from bimvox.records.lift import Lift
from bimvox.site.default_rules import NOTHING_KEPT
from bimvox.site.site import Site


def earlier_lifts(
    site: Site, preparation: Preparation, lifts: Sequence[Sequence[LiftWay]]
) -> tuple[frozenset[int], ...]:
    """Return for each of some lifts those of them that must be set before.

    Args:
        site: The site.
        preparation: What its plan was made from.
        lifts: The proven ways of planned lifts that follow each other in the plan.
    """
    graph = order_graph(site, preparation.relations, preparation.contacts)
    transit_m, rope_m = (site.rules.kept_m(name, NOTHING_KEPT) for name in ("transit_clearance_m", "rope_clearance_m"))
    site = replace(site, rules=replace(site.rules, transit_clearance_m=transit_m, rope_clearance_m=rope_m))
    swept = [[footprint for way in ways for footprint in _swept(site, way)] for ways in lifts]
    planned = [ways[0].lift for ways in lifts]
    lying = [_lying(site, lift) for lift in planned]
    placed = [_placed(site, lift) for lift in planned]
    unheld = frozenset(preparation.sequence.unheld)
    found: list[frozenset[int]] = []
    for b, later in enumerate(planned):
        earlier = set()
        for a, first in enumerate(planned[:b]):
            assert first.place is not None
            assert later.place is not None
            kept = (
                first.component in graph.earlier[later.component]
                or first.place.delivery != later.place.delivery
                or not unheld.isdisjoint((first.component, later.component))
                or any(lying[a].meets(footprint) for footprint in swept[b])
                or any(placed[b].meets(footprint) for footprint in swept[a])
            )
            if kept:
                earlier.add(a)
        found.append(frozenset(earlier))
    return tuple(found)


def _swept(site: Site, way: LiftWay) -> tuple[Footprint, MotionFootprint]:
    return path_footprint(site, way.lift), motion_footprint(site, way.lift, way.motion)


def _lying(site: Site, lift: Lift) -> CellMask:
    assert lift.place is not None
    return _mask(site, lift.place.shape.cells + np.array(lift.place.cell_vox, np.int32))


def _placed(site: Site, lift: Lift) -> CellMask:
    part = site.components[lift.component]
    return _mask(site, part.shape.cells + np.array(part.target_vox, np.int32))


def _mask(site: Site, cells: NDArray[np.int32]) -> CellMask:
    mask = CellMask(site.shape)
    mask.add(cells.astype(np.int32))
    return mask
