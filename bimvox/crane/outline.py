"""Outline of a crane: jib, counter-jib, mast, rope and load as simple solids.

Everything that slews is a strip along a ray from the slewing axis: two radii, a half width and two heights. The load on
the rope is a disc on plan. Two cranes are compared on plan, part by part, if the heights of the parts are near each
other. The solids contain the crane as it is rendered.
"""

from __future__ import annotations

from dataclasses import dataclass

from bimvox.crane.links import links_of, tower_head_m
from bimvox.crane.tower_crane import TowerCrane

_UNDER_JIB_M = 0.5
"""Trolley and catwalk below the rope's exit."""


@dataclass(frozen=True, slots=True)
class CraneOutline:
    """Solids of a crane that do not depend on its load.

    Attributes:
        name: Name of the crane, for messages.
        base_m: (x, y) of the slewing axis.
        jib_end_m: Radius of the jib's end; for a luffing jib at the smallest luff angle.
        jib_half_m: Half the jib's width.
        jib_m: Lowest and highest point of the jib above z = 0; for a luffing jib from the pivot to the highest tip.
        tail_m: Length of the counter-jib, or of the counterweight behind the axis.
        tail_half_m: Half its width.
        tail_height_m: Its lowest and highest point.
        mast_half_m: Radius of the circle around the mast section.
        mast_height_m: Lowest and highest point of the mast and its head.
        rope_top_m: Height of the rope exit; for a luffing jib the highest tip.
        luffs: Whether the jib luffs; if so, it ends above the hook.
    """

    name: str
    base_m: tuple[float, float]
    jib_end_m: float
    jib_half_m: float
    jib_m: tuple[float, float]
    tail_m: float
    tail_half_m: float
    tail_height_m: tuple[float, float]
    mast_half_m: float
    mast_height_m: tuple[float, float]
    rope_top_m: float
    luffs: bool

    @property
    def solids_m(self) -> tuple[float, ...]:
        """The 14 lengths above, in their order, from ``base_m`` to ``rope_top_m``, for compiled code."""
        return (
            *self.base_m,
            self.jib_end_m,
            self.jib_half_m,
            *self.jib_m,
            self.tail_m,
            self.tail_half_m,
            *self.tail_height_m,
            self.mast_half_m,
            *self.mast_height_m,
            self.rope_top_m,
        )


def outline_of(crane: TowerCrane) -> CraneOutline:
    """Return the solids of a crane, as its links have them."""
    solids = {box.name: box for boxes in links_of(crane).boxes.values() for box in boxes}
    x, y, foot_m = crane.base_m
    width, jib, top, tail = crane.mast_size_m, crane.luffing, highest_point_m(crane), solids["counterweight"]
    if jib is not None:
        return CraneOutline(
            crane.name,
            (x, y),
            jib_end_m=jib.radii_m[1],
            jib_half_m=jib.width_m / 2.0,
            jib_m=(jib.pivot_height_m - jib.width_m / 2.0, top),
            tail_m=-tail.low_m[0],
            tail_half_m=tail.high_m[1],
            tail_height_m=(jib.tail_low_m, jib.pivot_height_m + jib.width_m),
            mast_half_m=width / 2.0**0.5,
            mast_height_m=(foot_m, jib.pivot_height_m),
            rope_top_m=jib.highest_tip_m,
            luffs=True,
        )
    return CraneOutline(
        crane.name,
        (x, y),
        jib_end_m=solids["jib"].high_m[0],
        jib_half_m=width / 2.0,
        jib_m=(crane.jib_height_m - _UNDER_JIB_M, top),
        tail_m=-solids["counter_jib"].low_m[0],
        tail_half_m=tail.high_m[1],
        tail_height_m=(crane.jib_height_m - width, top),
        mast_half_m=width / 2.0**0.5,
        mast_height_m=(foot_m, top),
        rope_top_m=crane.jib_height_m,
        luffs=False,
    )


def tail_low_m(crane: TowerCrane) -> float:
    """Return the height of the underside of a crane's counterweight above the site's z = 0, as its links have it."""
    if crane.luffing is not None:
        return crane.luffing.tail_low_m
    (weight,) = (box for box in links_of(crane).boxes["jib"] if box.name == "counterweight")
    return crane.jib_height_m + weight.low_m[2]


def highest_point_m(crane: TowerCrane) -> float:
    """Return the height of the highest point of a crane above the site's z = 0."""
    if crane.luffing is not None:
        return crane.luffing.highest_tip_m + crane.luffing.width_m / 2.0
    return crane.jib_height_m + tower_head_m(crane)


Box = tuple[tuple[float, float, float], tuple[float, float, float]]


def mast_box_m(crane: TowerCrane) -> Box:
    """Return the lowest and the highest corner of the mast, from its foot up to the jib, metres.

    A luffing crane's mast ends at the pivot; for a mobile crane it is the box of undercarriage and outriggers.
    """
    x, y, z = crane.base_m
    half = crane.mast_size_m / 2.0
    top_m = crane.jib_height_m if crane.luffing is None else crane.luffing.pivot_height_m
    return (x - half, y - half, z), (x + half, y + half, top_m)
