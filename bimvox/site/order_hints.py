"""Order hints of the components, from the site file and the building file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import shapely

from bimvox.bim.building import Element
from bimvox.site.component import OrderHints
from bimvox.site.config.site_config import SiteConfig
from bimvox.site.work import kind_of


def order_hints(
    config: SiteConfig, elements: Sequence[Element], first: frozenset[str], connections: Sequence[tuple[str, str]]
) -> Mapping[str, OrderHints]:
    """Return the hints of every component. Tasks of a programme take the place of those in the building file.

    Args:
        config: The site file.
        elements: The components, in the site frame.
        first: Ids of those that the site file asks for first.
        connections: Pairs of ids that the building file connects.
    """
    programme = config.programme
    zones = [zone for zone in config.zone if zone.kind == "assembly"]
    polygons = [shapely.Polygon(zone.polygon) for zone in zones]
    heights = sorted({e.storey_height_m for e in elements if e.storey_height_m is not None})
    rank = {height: n for n, height in enumerate(heights)}
    partners: dict[str, set[str]] = {}
    for one, other in connections:
        partners.setdefault(one, set()).add(other)
        partners.setdefault(other, set()).add(one)
    hints = {}
    for element in elements:
        centre = shapely.Point(*(float(v) for v in np.mean(element.mesh.bounds_m, axis=0)[:2]))
        zone = next((n for n, polygon in enumerate(polygons) if polygon.covers(centre)), None)
        by_storey = config.sequence.storeys and element.storey_height_m is not None
        by_task = config.sequence.schedule
        task: tuple[str | None, int | None] = (element.task, element.task_rank)
        if programme is not None:
            set_by = programme.task_of(element)
            task = (None, None) if set_by is None else (set_by.name, set_by.rank)
        hints[element.id] = OrderHints(
            first=element.id in first,
            zone=zone,
            zone_name=None if zone is None else zones[zone].name or f"assembly zone {zone + 1}",
            task=task[0] if by_task else None,
            task_rank=task[1] if by_task else None,
            storey_rank=rank[element.storey_height_m] if by_storey and element.storey_height_m is not None else None,
            assembly=element.assembly,
            connected=tuple(sorted(partners.get(element.id, ()))),
            rank=getattr(config.sequence.ranks, kind_of(element)) if config.sequence.storeys else None,
        )
    return hints
