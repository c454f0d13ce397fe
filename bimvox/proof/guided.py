"""The proof of guided last moves: the load is tilted and held aside while its hook goes straight down."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bimvox.proof.bodies.triangles import TriangleCheck
from bimvox.proof.moment import NO_SOLID, Thing, beside, near_and_far
from bimvox.records.lift import (
    ASIDE_RATE_M_S,
    MOST_ASIDE_M,
    MOST_FORCE_N,
    MOST_TILT_RAD,
    TILT_RATE_RAD_S,
    Guide,
    Lift,
    side_force_n,
    swept_box_m,
)
from bimvox.records.proof import Check
from bimvox.site.component import Component
from bimvox.site.lifting import crane_for
from bimvox.site.parts import centre_of_mass_m
from bimvox.site.site import Site

_SAME_M = 1e-3
_CENTRE_M = 0.01
_SLACK = 1e-9
_FASTER = 1.001
_IN_LINE_VOX = 0.01


def check_guide(
    check: Check, triangles: TriangleCheck, site: Site, lift: Lift, component: Component, present: Sequence[Thing]
) -> None:
    """Check the poses of a guided load: that people can hold it so, and that it meets nothing."""
    guide = lift.guide
    assert guide is not None
    fault = _fault(site, lift, component, guide)
    check.look(fault is None, f"{component.id}: guided to its place, {fault}")
    if fault is not None:
        return
    near, far = near_and_far(component, present)
    low, high = guided_box_vox(site, component, guide)
    check.look(bool((low >= 0).all() and (high < site.shape).all()), f"{component.id}: guided, it leaves the site")
    for thing in beside(far, low.tolist(), high.tolist()):
        if thing.solid != NO_SOLID:
            triangles.check_guided(check, component, guide, thing.solid, is_near=False)
    for thing in near:
        triangles.check_guided(check, component, guide, thing.solid, is_near=True)
    for name in in_the_box(present, low, high):
        check.look(False, f"{component.id}: guided to its place, it comes into cells near {name}")


def guided_box_vox(site: Site, component: Component, guide: Guide) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the lowest and the highest cell of the box that a guided part sweeps, both inclusive."""
    tolerance_m = site.rules.contact_tolerance_m
    low_m, high_m = swept_box_m(component.mesh.vertices_m, guide)
    first, last = site.frame.cells_over(low_m + tolerance_m, high_m - tolerance_m)
    return first, last - 1


def in_the_box(things: Sequence[Thing], low: NDArray[np.int64], high: NDArray[np.int64]) -> list[str]:
    """Return the names of the things without triangles that have a cell in a box, both ends inclusive."""
    close = [thing for thing in beside(things, low.tolist(), high.tolist()) if thing.solid == NO_SOLID]
    return [thing.name for thing in close if ((thing.cells >= low) & (thing.cells <= high)).all(axis=1).any()]


def check_guiding(
    check: Check, name: str, guide: Guide, cells: NDArray[np.float64], time_s: NDArray[np.float64], voxel_size_m: float
) -> None:
    """Check that a load goes straight down while it is guided, and no faster than a crew can guide it.

    Args:
        check: Receives the result.
        name: The lift, for messages.
        guide: Its poses.
        cells: (N, 3) reference cells of the load on its last moves.
        time_s: (N,) their times.
        voxel_size_m: Edge of a cell.
    """
    height_m = (cells[:, 2] - cells[-1, 2]) * voxel_size_m
    begins = int(np.argmax(height_m < guide.top_m))
    cells, time_s, poses = cells[begins:], time_s[begins:], guide.at(height_m[begins:])
    aside = np.abs(cells[:, :2] - cells[-1, :2]).max(initial=0.0)
    check.look(bool(aside <= _IN_LINE_VOX), f"{name}: its hook does not go straight down while the load is guided")
    moves, spans_s = np.abs(np.diff(poses, axis=0)), np.diff(time_s)
    for n, (most, what) in enumerate(((ASIDE_RATE_M_S, "aside"), (TILT_RATE_RAD_S, "to a tilt"))):
        bad = np.flatnonzero(moves[:, n] > most * _FASTER * spans_s + _SLACK)
        at = "" if not len(bad) else f" at {time_s[bad[0]]:.2f} s"
        check.look(not len(bad), f"{name}: its load is guided {what} faster than a crew can{at}", samples=len(moves))


def _fault(site: Site, lift: Lift, component: Component, guide: Guide) -> str | None:
    """Return why a crew cannot guide a load so, or None."""
    poses, path = np.array(guide.poses, np.float64).reshape(-1, 3), lift.path_vox
    numbers = np.array([*poses.ravel(), guide.heading_rad, *guide.centre_m])
    if path is None or len(poses) < 2 or not np.isfinite(numbers).all():
        return "its poses are not numbers"
    if (np.diff(poses[:, 0]) >= 0.0).any() or poses[-1].any() or poses[0, 1:].any():
        return "it does not come down from level above its place to its place"
    if abs(poses[0, 0] - lift.contact_moves * site.frame.voxel_size_m) > _SAME_M:
        return "its poses do not begin where its last moves do"
    if (path[len(path) - 1 - lift.contact_moves :, :2] != path[-1, :2]).any():
        return "its last moves do not lead straight down"
    if guide.steepest_rad > MOST_TILT_RAD + _SLACK:
        return f"it is tilted by {np.degrees(guide.steepest_rad):.1f} degrees; {np.degrees(MOST_TILT_RAD):.1f} at most"
    if guide.furthest_m > MOST_ASIDE_M + _SLACK:
        return f"it is held {guide.furthest_m:.2f} m aside; {MOST_ASIDE_M:g} m at most"
    crane = site.crane_of(component)
    if crane is None or site.has_several_cranes:
        return "on a site that does not have exactly one crane"
    centre_m = centre_of_mass_m(component.mesh)
    if centre_m is None or np.abs(centre_m - guide.centre_m).max() > _CENTRE_M:
        return "it is not tilted about its centre of mass"
    top_m = site.frame.corner_of(np.array(component.target_vox) + np.array(component.hook_offset_vox))[2]
    rope_m = crane.jib_height_m - top_m - crane_for(site, crane, component).sling_m
    force_n = side_force_n(component.mass_kg, guide.furthest_m, rope_m)
    if force_n > MOST_FORCE_N * (1.0 + 1e-6):
        return f"it is held {guide.furthest_m:.2f} m aside with {force_n:.0f} N; {MOST_FORCE_N:g} N at most"
    return None
