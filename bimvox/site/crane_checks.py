"""Checks of several cranes against each other; errors name the key, before anything is planned."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations, permutations
from math import hypot

from bimvox.crane.outline import mast_box_m, outline_of
from bimvox.crane.tower_crane import TowerCrane
from bimvox.site.config.site_config import SiteConfig

_SLACK_M = 0.1


def crane_key(number: int, count: int) -> str:
    """Return the key of a crane's table in the site file."""
    return "crane" if count == 1 else f"crane[{number}]"


def check_cranes(config: SiteConfig, cranes: Sequence[TowerCrane], separation_m: float) -> None:
    """Raise an error for masts without a height or that overlap, and for a jib that would hit another crane's mast.

    A jib must pass above another crane's highest point or stay short of its mast, whatever the slew angles. Two jibs at
    the same height may reach into each other's circle: the cranes share that space in time.

    Raises:
        ConfigError: Names the crane, or both.
    """
    for number, crane in enumerate(cranes):
        (*_, foot_m), (*_, top_m) = mast_box_m(crane)
        if foot_m >= top_m:
            raise config.error(
                f"{crane_key(number, len(cranes))}.base_m",
                f"{crane.name} stands at a height of {foot_m:.1f} m, but its mast ends at {top_m:.1f} m above the "
                "site's z = 0",
                hint="raise jib_height_m, move the crane to lower ground, or give base_m a third value: the height of "
                "its foot",
            )
    for a, b in combinations(range(len(cranes)), 2):
        one, other = cranes[a], cranes[b]
        (low, high), (low_b, high_b) = mast_box_m(one), mast_box_m(other)
        if all(low[i] - separation_m < high_b[i] and low_b[i] - separation_m < high[i] for i in (0, 1)):
            raise config.error(
                f"crane[{b}].base_m",
                f"the masts of {other.name} and {one.name} overlap or are closer than {separation_m:g} m",
                hint="move one of them: masts keep [rules] crane_separation_m between them",
            )
    for a, b in permutations(range(len(cranes)), 2):
        own, mast = outline_of(cranes[a]), outline_of(cranes[b])
        apart_m, top_m = hypot(mast.base_m[0] - own.base_m[0], mast.base_m[1] - own.base_m[1]), mast.mast_height_m[1]
        for what, reach_m, half_m, lowest_m in (
            ("jib", own.jib_end_m, own.jib_half_m, own.jib_m[0]),
            ("counter-jib", own.tail_m, own.tail_half_m, own.tail_height_m[0]),
        ):
            # The same outline as for keeping cranes apart over time: a strip with round ends.
            needed_m = reach_m + half_m + mast.mast_half_m + separation_m + _SLACK_M
            if apart_m >= needed_m or lowest_m >= top_m + separation_m:
                continue
            raise config.error(
                f"crane[{a}].base_m",
                f"the {what} of {own.name} would hit the mast of {mast.name}: it reaches {reach_m:.1f} m at a height "
                f"of {lowest_m:.1f} m, but the mast is {apart_m:.1f} m away and {top_m:.1f} m high",
                hint=f"put them {needed_m:.1f} m apart, or the {what} {separation_m:g} m above the other crane's top",
            )
