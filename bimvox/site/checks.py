"""Checks of a site file against the building; errors name the key, before anything is planned."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import Element
from bimvox.grid.frame import GridFrame
from bimvox.site.component import Component, IntVec, StoredPose
from bimvox.site.config.site_config import SiteConfig
from bimvox.site.means import Means
from bimvox.site.shape import stored_shape
from bimvox.site.site import Blocker

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
            raise config.error(f"{key}.base_m", f"the mast is at the place of component {component.label}")


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
