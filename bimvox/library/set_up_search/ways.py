"""What the closer estimate knows of a site with one yard: its parts, their picks, and what loads keep clear of."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field

import numpy as np
import shapely
from numpy.typing import NDArray

from bimvox.bim.building import BUILT, Building, Element
from bimvox.grid.frame import whole_cells
from bimvox.library.set_up_search.picks import Picks, around_m, taken_m2
from bimvox.site.component import Component
from bimvox.site.config.site_config import SiteConfig
from bimvox.site.extent import site_extent
from bimvox.site.means import Means
from bimvox.site.set_ups import LiftWork
from bimvox.site.site import Site, SwingRule
from bimvox.site.transit_clearance import margin_vox


@dataclass(frozen=True, slots=True, eq=False)
class Ways:
    """What the closer look knows of a site with one yard.

    Attributes:
        work: The parts in their erection sequence.
        picks: Where they are picked.
        around_m: (N, 2, 2) lowest and highest corner of each part on plan, as seen from its hook.
        bounds_m: (2, 2) lowest and highest corner of the site on plan; masts may stand outside.
        clearance_m: Of loads in transit, from everything.
        mast_m: The same from the sides of the mast.
        cell_m: Edge of a cell.
        swings: Whether moves are shaped against the swing of loads.
        turn_s: How long a load is turned by a quarter.
        others_m: (M, 2, 2) lowest and highest corner on plan of what no crane lifts.
        other_tops_m: (M,) its tops.
        others_before: (M,) the part before which it is there.
    """

    work: LiftWork
    picks: Picks
    around_m: NDArray[np.float64]
    bounds_m: NDArray[np.float64]
    clearance_m: float = 0.0
    mast_m: float = 0.0
    cell_m: float = 0.0
    swings: bool = True
    turn_s: float = 0.0
    others_m: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 2, 2)))
    other_tops_m: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    others_before: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, np.int64))

    def passed_m(self, n: int, hooks_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (S,) how high it is built by then where a part with its clearance passes, with its hook at (S, 2)."""
        there = self.others_before <= n
        lows_m, highs_m = (
            np.concatenate([self.work.places_m[:n] + self.around_m[:n, side], self.others_m[there, side]])
            for side in (0, 1)
        )
        tops_m = np.concatenate([self.work.tops_m[:n], self.other_tops_m[there]])
        low_m, high_m = (
            hooks_m + self.around_m[n, 0] - self.clearance_m,
            hooks_m + self.around_m[n, 1] + self.clearance_m,
        )
        near = ((lows_m < high_m.max(axis=0)) & (highs_m > low_m.min(axis=0))).all(axis=1)
        passed = ((lows_m[near] < high_m[:, None]) & (highs_m[near] > low_m[:, None])).all(axis=2)
        found: NDArray[np.float64] = (passed * tops_m[near]).max(axis=1, initial=0.0)
        return found

    def raised_to_turn_m(self, n: int, at_m: NDArray[np.float64]) -> float:
        """Return how high a part must be raised above (2,) its pick to be turned above all that is built by then."""
        low_m, high_m = (self.work.places_m[:n] + self.around_m[:n, side] for side in (0, 1))
        beyond_m = np.maximum(np.maximum(low_m - at_m, at_m - high_m), 0.0)
        round_m = np.hypot(*np.abs(self.around_m[n]).max(axis=0))
        top_m: float = self.work.tops_m[:n][np.hypot(*beyond_m.T) < round_m].max(initial=0.0)
        return max(self.cell_m, top_m)


def ways_on(
    site: Site,
    sequence: Sequence[Component],
    work: LiftWork,
    config: SiteConfig,
    building: Building,
) -> Ways:
    """Return the ways of a site.

    Args:
        site: With the rules of the site file.
        sequence: The parts in their sequence, also those that no crane lifts.
        work: Those that cranes lift, with their rooms in the yard.
        config: The site file, with the yard.
        building: In the site frame.
    """
    components = [part for part in sequence if part.means is Means.CRANE]
    cell_m, around = site.frame.voxel_size_m, around_m(components, site.frame.voxel_size_m)
    clearance_m = margin_vox(site) * cell_m
    frame, shape = site_extent(config, building)
    low_m = np.array(frame.origin_m[:2])
    lifts = np.cumsum([part.means is Means.CRANE for part in sequence]).tolist()
    before = {part.id: n for part, n in zip(sequence, lifts, strict=True)}
    others = [one for one in building.elements if _stands(one, {part.id for part in components})]
    yard = shapely.union_all([shapely.Polygon(one) for one in config.areas.yard or ()])
    bounds_m = np.array([one.mesh.bounds_m for one in others]).reshape(-1, 2, 3)
    return Ways(
        work,
        Picks(yard.area, work.yard_m, work.rooms, taken_m2(site, components)),
        around,
        np.stack([low_m + clearance_m, low_m + np.array(shape[:2]) * cell_m - clearance_m]),
        clearance_m,
        clearance_m + whole_cells(site.rules.clearance_m, cell_m) * cell_m,
        cell_m,
        site.rules.swing is SwingRule.SHAPED,
        site.rules.turn_s,
        bounds_m[:, :, :2],
        bounds_m[:, 1, 2],
        np.array([before.get(one.id, 0) for one in others], np.int64),
    )


def _stands(element: Element, lifted: Collection[str]) -> bool:
    """Return whether an element is in the way of loads, but not lifted itself."""
    return element.role in BUILT and element.id not in lifted
