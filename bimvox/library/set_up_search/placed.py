"""A site file with its building in the site frame: what there is to lift, before any cell is made."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import Building, Element, Role
from bimvox.site.config.site_config import SiteConfig
from bimvox.site.extent import top_m
from bimvox.site.one_piece import means_by
from bimvox.site.parts import entries_by_id
from bimvox.site.placement import place_building


@dataclass(frozen=True, eq=False)
class PlacedSite:
    """A site file and its building.

    Attributes:
        config: The values of the site file, complete, in the site's frame.
        building: The building as read.
    """

    config: SiteConfig
    building: Building

    @cached_property
    def _placing(self) -> tuple[Building, NDArray[np.float64]]:
        return place_building(self.config, self.building)

    @property
    def placed(self) -> Building:
        """The building in the site frame."""
        return self._placing[0]

    @property
    def site_to_ifc(self) -> NDArray[np.float64]:
        """(4, 4) transform from the site frame to model coordinates."""
        return self._placing[1]

    @cached_property
    def parts(self) -> list[Element]:
        """Everything that is not there already."""
        pinned = {name for name, entry in self.entries.items() if entry.pinned}
        return [one for one in self.placed.elements if one.role is Role.COMPONENT and one.id not in pinned]

    @cached_property
    def entries(self) -> Mapping[str, Any]:
        """The ``[[component]]`` table of each part that has one, by element id."""
        return entries_by_id(self.config, self.placed.elements)

    @cached_property
    def means(self) -> dict[str, str]:
        """How each part gets to its place, by id."""
        found = means_by(self.config, self.parts, self.entries)
        return {name: one.means.value for name, one in found.items()}

    @cached_property
    def load_top_m(self) -> float:
        """Height that the top of a load must reach."""
        return top_m(self.placed) + 2 * (self.config.model.voxel_size_m or 0.0)
