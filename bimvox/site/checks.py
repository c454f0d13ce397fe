"""Checks of a site file against the building; errors name the key, before anything is planned."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations, permutations
from math import ceil, hypot
from typing import Final

import numpy as np
import shapely
from numpy.typing import NDArray

from bimvox.bim.building import Element
from bimvox.crane.outline import mast_box_m, outline_of
from bimvox.crane.tower_crane import TowerCrane
from bimvox.grid.frame import GridFrame
from bimvox.site.areas import columns_centred_in
from bimvox.site.collision import HOOK_FORBIDDEN, hook_room
from bimvox.site.component import Component, IntVec, StoredPose, stored_shape
from bimvox.site.config.site_config import AreasConfig, SiteConfig
from bimvox.site.crane_distances import is_in, stand_of
from bimvox.site.lifting import shares_to_try
from bimvox.site.means import Means
from bimvox.site.site import Blocker, Site

_MOST_SAMPLES = 4_000_000
"""About 1 GB of log and memory."""
_LIFT_S = 60.0
"""How long a crane moves for a lift, about."""


def check_component(
    config: SiteConfig, element: Element, cells: NDArray[np.int32], frame: GridFrame, shape: IntVec
) -> None:
    """Raise an error for a component that reaches outside the grid."""
    low_m, high_m = element.mesh.bounds_m
    first, last = frame.cells_over(low_m + 1e-4, high_m - 1e-4)
    outside = (first < [0, 0, 1]).any() or (last > np.array(shape)).any()
    if not len(cells) or outside or cells[:, 2].min() < 1:
        raise config.error(
            "grid" if config.grid else "areas",
            f"component {element.label}, from {shown_m(low_m)} to {shown_m(high_m)} m, lies outside the site's extent",
            hint="widen [grid] low_m, high_m, or leave [grid] out",
        )


def check_mast(config: SiteConfig, key: str, mast: Blocker, components: Sequence[Component], shape: IntVec) -> None:
    """Raise an error for a mast at the place of a component."""
    there = np.zeros(shape, np.bool_)
    there[tuple(mast.cells.T)] = True
    for component in components:
        if there[tuple((component.shape.cells + np.array(component.target_vox)).T)].any():
            raise config.error(key, f"the mast is at the place of component {component.label}")


def check_stands(config: SiteConfig, cranes: Sequence[TowerCrane], structure: Sequence[Blocker]) -> None:
    """Raise an error for a set-up of a crane that moves in what exists already.

    Raises:
        ConfigError: Names the set-up.
    """
    for number, crane in enumerate(cranes):
        for solid in stand_of(crane):
            for one in structure:
                if solid.name != "tail" and one.mesh is not None and is_in(solid, one.mesh):
                    raise config.error(
                        config.crane_key(number),
                        f"the {solid.name} would stand in {one.name or one.id}, which exists already",
                        hint="move the set-up; if it stands on it, give base_m a third value: the height of its foot",
                    )


def check_samples(config: SiteConfig, components: Sequence[Component]) -> None:
    """Raise an error for a sampling interval that gives more samples than memory holds."""
    lifts, period_s = sum(component.means is Means.CRANE for component in components), config.rules.sample_period_s
    least_s = lifts * _LIFT_S / _MOST_SAMPLES
    if period_s < least_s:
        raise config.error(
            "rules.sample_period_s",
            f"{period_s:g} s gives about {lifts * _LIFT_S / period_s:,.0f} samples for {lifts:,} lifts",
            hint=f"give {ceil(1e3 * least_s) / 1e3:g} s or more",
        )


def check_yard(
    config: SiteConfig, yard: NDArray[np.bool_], components: Sequence[Component], tops: NDArray[np.int32], shape: IntVec
) -> None:
    """Raise an error for a site without a yard, and for a component whose ``start`` is outside it or in the ground.

    ``tops``: (X, Y) the highest layer of the ground.
    """
    starts = [component for component in components if component.start_vox is not None]
    if not yard.any() and len(starts) < len(components):
        others = "construction area and access" if config.areas.access else "the construction area"
        raise config.error(
            "areas.yard", f"covers no cell of the site outside {others}", hint="move or enlarge the yard"
        )
    for component in starts:
        assert component.start_vox is not None
        pose = component.stored_pose
        turn = component.stored_turn or 0
        lying = stored_shape(component.shape, pose or StoredPose.AS_BUILT, turn)
        cells = lying.cells + np.array(component.start_vox)
        number = [entry.global_id for entry in config.component].index(_named(config, component))
        key = f"component[{number}].start"
        inside = ((cells >= 0) & (cells < np.array(shape))).all(axis=1)
        if (cells[inside, 2] <= tops[tuple(cells[inside, :2].T)]).any() or (cells[:, 2] < 1).any():
            raise config.error(key, f"{component.label} would lie in the ground", hint="z = 0 is the top of the ground")
        if not inside.all() or not yard[tuple(cells[:, :2].T)].all():
            raise config.error(
                key,
                f"{component.label} would lie outside the yard",
                hint="start is the lowest corner of the part as stored; move it, or enlarge [areas] yard",
            )


def _named(config: SiteConfig, component: Component) -> str:
    """Return the id under which the site file lists a component."""
    listed = {entry.global_id for entry in config.component}
    return component.id if component.id in listed else component.global_id


def shown_m(point_m: NDArray[np.float64]) -> str:
    """Return a point as messages state it."""
    return "(" + ", ".join(f"{value:.2f}" for value in point_m) + ")"


# The access of trucks: where they stand, and which parts the crane can unload there.
#
# Only the places are looked at here: that no part lies in the way of a truck, and that the crane carries a part over
# some place where a truck stands. How a truck is loaded and driven is not.

TRUCK_WIDTH_M: Final = 2.55
"""The widest vehicle without a permit (Directive 96/53/EC)."""
DECK_M: Final = 1.2
"""Height of a truck's deck; typical of flat-bed semi-trailers."""


def ground_of(
    areas: AreasConfig, frame: GridFrame, shape: tuple[int, int]
) -> tuple[NDArray[np.bool_], NDArray[np.bool_] | None]:
    """Return the (X, Y) columns of the yard, those of the access left out, and those of the access; None without."""
    yard = columns_centred_in(areas.yard or (), frame, shape)
    if areas.access is None:
        return yard, None
    access = columns_centred_in(areas.access, frame, shape)
    return yard & ~access, access


def check_access(config: SiteConfig) -> None:
    """Raise an error for an access on which no truck can stand.

    Raises:
        ConfigError: Names the polygon.
    """
    for number, polygon in enumerate(config.areas.access or ()):
        if shapely.Polygon(polygon).buffer(0.001 - TRUCK_WIDTH_M / 2.0).is_empty:
            raise config.error(
                f"areas.access[{number}]",
                f"is nowhere {TRUCK_WIDTH_M:g} m wide, as a truck is",
                hint="widen it; 4 m leaves room for a person on one side",
            )


def unloading_columns(site: Site, component: Component) -> NDArray[np.int64]:
    """Return the (N, 2) columns of the access over which its crane carries a part, gear included.

    On a site without an access or a crane there are none.
    """
    crane = site.crane_of(component)
    if site.access is None or crane is None:
        return np.zeros((0, 2), np.int64)
    flat = np.zeros(site.shape[:2], np.int32)
    free = np.zeros(site.shape[:2], np.bool_)
    for most_used in shares_to_try(site.rules):
        room = hook_room(site, crane, flat, component, most_used=most_used)
        free = site.access & (room.floor < HOOK_FORBIDDEN)
        if free.any():
            break
    return np.argwhere(free)


_SLACK_M = 0.1


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
                config.crane_key(number),
                f"{crane.name} stands at a height of {foot_m:.1f} m, but its mast ends at {top_m:.1f} m above the "
                "site's z = 0",
                hint="raise jib_height_m, move the crane to lower ground, or give base_m a third value: the height of "
                "its foot",
            )
    if config.moves:
        return
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
