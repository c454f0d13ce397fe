"""What the closer estimate knows of a site with one yard: its parts, their picks, and what loads keep clear of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import Building
from bimvox.grid.frame import whole_cells
from bimvox.library.set_up_search.picks import Picks, around_m, taken_m2
from bimvox.site.component import Component
from bimvox.site.config.site_config import SiteConfig
from bimvox.site.extent import site_extent
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
    """

    work: LiftWork
    picks: Picks
    around_m: NDArray[np.float64]
    bounds_m: NDArray[np.float64]
    clearance_m: float = 0.0
    mast_m: float = 0.0
    cell_m: float = 0.0
    swings: bool = True

    def clear_m(self, n: int) -> float:
        """Return how high a part must be raised to be clear of the ground and what is built around its place."""
        low_m, high_m = (self.work.places_m + self.around_m[:, side] for side in (0, 1))
        near = (low_m[:n] < high_m[n] + self.clearance_m) & (high_m[:n] > low_m[n] - self.clearance_m)
        top_m: float = self.work.tops_m[:n][near.all(axis=1)].max(initial=0.0)
        return top_m + self.clearance_m


def ways_on(
    site: Site, components: Sequence[Component], work: LiftWork, config: SiteConfig, building: Building
) -> Ways:
    """Return the ways of a site.

    Args:
        site: With the rules of the site file.
        components: The parts that cranes lift, in their sequence.
        work: The same, with every place of the yard.
        config: The site file, with the yard.
        building: In the site frame.
    """
    cell_m, around = site.frame.voxel_size_m, around_m(components, site.frame.voxel_size_m)
    clearance_m = margin_vox(site) * cell_m
    frame, shape = site_extent(config, building)
    low_m = np.array(frame.origin_m[:2])
    return Ways(
        work,
        Picks(config.areas.yard or (), work.yard_m, around, taken_m2(site, components)),
        around,
        np.stack([low_m + clearance_m, low_m + np.array(shape[:2]) * cell_m - clearance_m]),
        clearance_m,
        clearance_m + whole_cells(site.rules.clearance_m, cell_m) * cell_m,
        cell_m,
        site.rules.swing is SwingRule.SHAPED,
    )
