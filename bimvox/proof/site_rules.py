"""The proof that a lift respects the zones, the wind limit and the storage of the site file, without the planner."""

from __future__ import annotations

import numpy as np
import shapely
from numpy.typing import NDArray

from bimvox.crane.tower_crane import TowerCrane
from bimvox.proof.space import whole_cells
from bimvox.records.lift import Lift, YardPlace
from bimvox.records.proof import Check
from bimvox.site.component import Component, StoredPose
from bimvox.site.site import Site

_TURN = np.radians(15.0)
_PERMITTED_M2_PER_T = 1.2
"""Wind area per tonne that a crane's own wind limit assumes (EN 13000)."""
_SHARE = 1e-6
_GRID_M = 1e-5
"""Corners of an outline are rounded to this; so its area may be off by as much times its length."""


def check_zones(check: Check, site: Site, component: Component, path: NDArray[np.int32]) -> None:
    """Check that hook and load of every placement ((N, 3)) stay outside the zones that are closed to them."""
    hook = path + np.array(component.hook_offset_vox, np.int32)
    if site.prohibited is not None:
        over = site.prohibited[hook[:, 0], hook[:, 1]]
        check.look(
            not over.any(),
            f"{component.id}: its hook is over a prohibited zone at {hook[over][:1].tolist()}",
            samples=len(path),
        )
    if site.no_load is not None:
        columns = np.unique(component.shape.cells[:, :2], axis=0)
        at = path[:, None, :2] + columns[None]
        over = site.no_load[at[..., 0], at[..., 1]].any(axis=1)
        check.look(
            not over.any(),
            f"{component.id}: the load is over a zone that is closed to it, at {path[over][:1].tolist()}",
            samples=len(path),
        )
    if site.hook_heights is not None and (crane := site.crane_of(component)) is not None:
        step_m = site.frame.voxel_size_m
        height_m = site.frame.origin_m[2] + hook[:, 2] * step_m + crane.sling_m
        height_m += component.lifting.sling_rise_vox * step_m
        low, high = (limit[hook[:, 0], hook[:, 1]] for limit in (site.hook_heights.low_m, site.hook_heights.high_m))
        bad = (height_m < low - _SHARE) | (height_m > high + _SHARE)
        check.look(
            not bad.any(),
            f"{component.id}: its hook is not as high as a limiter wants it, at {hook[bad][:1].tolist()}",
            samples=len(path),
        )


def check_wind(check: Check, site: Site, crane: TowerCrane, component: Component) -> None:
    """Check that the site's wind is permitted for a part, by the outline of its triangles from every side."""
    wind = site.rules.wind_speed_m_s
    if wind <= 0.0:
        return
    area_m2 = shown_m2(component.mesh.triangles_m, component.sail_area_m2)
    check.look(
        area_m2 <= component.sail_area_m2 * (1.0 + _SHARE) + _SHARE,
        f"{component.id}: it shows the wind {area_m2:.3f} m2, not {component.sail_area_m2:.3f} m2",
    )
    hung_t = (component.mass_kg + crane.rigging_mass_kg + crane.hook_block_kg) / 1000.0
    sail = max(component.sail_area_m2, area_m2) * site.rules.drag_coefficient
    pressed = wind**2 / crane.max_wind_m_s**2 * max(1.0, sail / (_PERMITTED_M2_PER_T * hung_t))
    check.measure(float(np.sqrt(pressed)))
    check.look(
        bool(pressed <= 1.0 + _SHARE) or "wind_speed_m_s" in site.rules.gives_way,
        f"{component.id}: {sail:.1f} m2 of sail (drag included) and {hung_t:.2f} t in wind of {wind:g} m/s",
    )


def check_rope_margin(
    check: Check, site: Site, lift: Lift, component: Component, counts: NDArray[np.uint16], gate: int
) -> None:
    """Check that in transit, within the clearance in plan, nothing is higher than the end of the hook line.

    Exceptions: the first placements straight up from the yard while something is near, and the last moves, which begin
    at placement ``gate``. ``counts`` is how many things occupy each cell, (X, Y, Z).
    """
    assert lift.path_vox is not None
    path = lift.path_vox
    kept_m = site.rules.kept_m("rope_clearance_m", lift.clearance_m)
    reach = whole_cells(kept_m, site.frame)
    if reach == 0:
        return
    near = np.zeros(len(path), np.bool_)
    for n, (x, y, z) in enumerate((path + np.array(component.hook_offset_vox, np.int32)).tolist()):
        beside = counts[max(0, x - reach) : x + reach + 1, max(0, y - reach) : y + reach + 1, max(0, z) :]
        near[n] = bool(beside.any())
    rising = (path[:, :2] == path[0, :2]).all(axis=1) & (np.diff(path[:, 2], prepend=path[0, 2] - 1) == 1)
    leaving = np.logical_and.accumulate(rising & near)
    bad = np.flatnonzero((near & ~leaving)[: gate + 1])
    check.look(
        not len(bad),
        f"{component.id}: at {bad[:1]} its rope is nearer than {kept_m:g} m to something",
        samples=gate + 1,
    )


def shown_m2(triangles_m: NDArray[np.float64], claimed_m2: float) -> float:
    """Return the largest area that triangles ((N, 3, 3)) show from the sides; the claim if they show no more.

    Two bounds decide about most shapes: the outline of the corners' hull and, for a closed surface, half of all faces.
    The union of the triangles decides about the others.
    """
    angles = np.arange(0.0, np.pi - 1e-9, _TURN)
    seen = [_seen_from(triangles_m, angle) for angle in angles]
    hulls = [shapely.convex_hull(shapely.multipoints(flat.reshape(-1, 2))).area for flat in seen]
    halves = [0.5 * shapely.area(shapely.polygons(flat)).sum() for flat in seen]
    most_m2 = claimed_m2 * (1.0 + _SHARE) + _SHARE
    bounds = np.minimum(hulls, halves) if _closes(triangles_m) else np.array(hulls)
    areas = [claimed_m2, *(_outlined_m2(flat) for flat, bound in zip(seen, bounds, strict=True) if bound > most_m2)]
    return float(max(areas))


def _seen_from(triangles_m: NDArray[np.float64], angle_rad: float) -> NDArray[np.float64]:
    """Return (M, 3, 2) the triangles in a horizontal view from one side, without those that are seen edge-on."""
    aside = np.array([-np.sin(angle_rad), np.cos(angle_rad), 0.0])
    flat = np.stack([triangles_m @ aside, triangles_m[:, :, 2]], axis=2)
    found: NDArray[np.float64] = flat[shapely.area(shapely.polygons(flat)) > _GRID_M**2]
    return found


def _outlined_m2(flat: NDArray[np.float64]) -> float:
    """Return the area of the union of (M, 3, 2) triangles, less the rounding of its corners."""
    outline = shapely.union_all(shapely.polygons(flat), grid_size=_GRID_M)
    return float(outline.area - _GRID_M * outline.length)


def _closes(triangles_m: NDArray[np.float64]) -> bool:
    """Return whether every edge belongs to an even number of (N, 3, 3) triangles."""
    odd: set[frozenset[tuple[float, ...]]] = set()
    for a, b, c in (tuple(map(tuple, triangle)) for triangle in triangles_m.tolist()):
        for edge in (frozenset((a, b)), frozenset((b, c)), frozenset((c, a))):
            odd ^= {edge}
    return all(len(edge) == 1 for edge in odd)


def check_stored(check: Check, component: Component, place: YardPlace) -> None:
    """Check that a part lies as the site file says, otherwise down if it is upended and upright if it is not."""
    if component.stored_pose is not None:
        wanted: tuple[StoredPose, ...] = (component.stored_pose,)
    else:
        wanted = (StoredPose.LYING_X, StoredPose.LYING_Y) if component.erected else (StoredPose.AS_BUILT,)
    check.look(
        place.pose in wanted,
        f"{component.label}: is stored {place.pose.value}, not {' or '.join(pose.value for pose in wanted)}",
    )
    if component.stored_turn is not None:
        check.look(
            place.turn == component.stored_turn,
            f"{component.label}: is stored turned by {place.turn} quarters, the site file says {component.stored_turn}",
        )
