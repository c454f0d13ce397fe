"""The space that the crane itself occupies on the site."""

from __future__ import annotations

from bimvox.crane.tower_crane import TowerCrane

Box = tuple[tuple[float, float, float], tuple[float, float, float]]


def mast_box_m(crane: TowerCrane) -> Box:
    """Return the lowest and the highest corner of the mast, from its foot up to the jib, metres.

    A luffing crane's mast ends at the pivot; for a mobile crane it is the box of undercarriage and outriggers.
    """
    x, y, z = crane.base_m
    half = crane.mast_size_m / 2.0
    top_m = crane.jib_height_m if crane.luffing is None else crane.luffing.pivot_height_m
    return (x - half, y - half, z), (x + half, y + half, top_m)
