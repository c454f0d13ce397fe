"""How two cranes carry a part together."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class SharedLoad:
    """The share of each of two cranes, the first one that of the part.

    Attributes:
        cranes: Indices in ``Site.cranes``.
        points_m: Where each holds it: (x, y, z) with the part at its place in the building, metres in the site frame.
        load_kg: Share of its mass on each hook while it hangs level.
        most_kg: The largest share while it hangs out of level by no more than ``off_level_rad``.
        used: Largest share of the load chart of each on its way: that mass, rigging and hook block.
        radius_m: Largest radius of each hook on its way.
        apart_m: Distance of the two hooks, which stays the same.
        off_level_rad: How far it may hang out of level.
    """

    cranes: tuple[int, int]
    points_m: tuple[tuple[float, float, float], tuple[float, float, float]]
    load_kg: tuple[float, float]
    most_kg: tuple[float, float]
    used: tuple[float, float]
    radius_m: tuple[float, float]
    apart_m: float
    off_level_rad: float
