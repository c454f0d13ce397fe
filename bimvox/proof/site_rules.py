"""The proof that a lift respects zones, wind limit and storage of the site file, and its place in the yard."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh
from bimvox.compiled import kernel
from bimvox.crane.tower_crane import TowerCrane
from bimvox.kept import kept
from bimvox.proof.bodies.solid import point_numbers
from bimvox.proof.clearance import nearest_to_rope
from bimvox.proof.flip import is_turned_over, swept_vox
from bimvox.proof.moment import Thing, beside
from bimvox.proof.rigging import rigging_kg
from bimvox.proof.space import whole_cells
from bimvox.proof.storage import check_truck, stands_on_something
from bimvox.records.lift import Lift, YardPlace
from bimvox.records.proof import Check
from bimvox.site.component import Component, StoredPose, erection_size_vox, stored_shape, turned_hook, turned_shape
from bimvox.site.site import Rules, Site


def first_of(values: NDArray[Any]) -> str:
    """Return the first of some numbers, or of some cells as ``(x, y, z)``; empty if there are none."""
    if not len(values):
        return ""
    first = values[0].tolist()
    return str(tuple(first)) if isinstance(first, list) else f"{first:g}"


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
            f"{component.id}: its hook is over a prohibited zone at {first_of(hook[over])}",
            samples=len(path),
        )
    check_no_load(check, site, component.id, component.shape.cells, path)
    if site.hook_heights is not None and (crane := site.crane_of(component)) is not None:
        step_m = site.frame.voxel_size_m
        height_m = site.frame.origin_m[2] + hook[:, 2] * step_m + crane.sling_m
        height_m += component.lifting.sling_rise_vox * step_m
        low, high = (limit[hook[:, 0], hook[:, 1]] for limit in (site.hook_heights.low_m, site.hook_heights.high_m))
        bad = (height_m < low - _SHARE) | (height_m > high + _SHARE)
        check.look(
            not bad.any(),
            f"{component.id}: its hook is not as high as a limiter wants it, at {first_of(hook[bad])}",
            samples=len(path),
        )


def check_no_load(check: Check, site: Site, name: str, own: NDArray[np.int32], path: NDArray[np.int32]) -> None:
    """Check that the cells of a load ((C, 3), relative), at placements ((N, 3)), are over no zone closed to it."""
    if site.no_load is not None:
        columns = np.unique(own[:, :2], axis=0)
        at = path[:, None, :2] + columns[None]
        over = site.no_load[at[..., 0], at[..., 1]].any(axis=1)
        check.look(
            not over.any(),
            f"{name}: the load is over a zone that is closed to it, at {first_of(path[over])}",
            samples=len(path),
        )


def asks_for_wind(rules: Rules) -> bool:
    """Return whether the rules ask for a wind in which lifts are permitted."""
    return rules.wind_speed_m_s > 0.0 or (rules.least_wind_m_s > 0.0 and "least_wind_m_s" not in rules.gives_way)


def asked_wind_m_s(rules: Rules) -> float:
    """Return the wind in which every lift must be permitted, as the site file asks; defaults ask for none."""
    least = 0.0 if "least_wind_m_s" in rules.gives_way else rules.least_wind_m_s
    return max(least, 0.0 if "wind_speed_m_s" in rules.gives_way else rules.wind_speed_m_s)


def most_wind_m_s(crane: TowerCrane, component: Component, sail_m2: float) -> float:
    """Return the wind up to which crane and sail area (drag included) permit a part."""
    hung_t = (component.mass_kg + rigging_kg(crane, component) + crane.hook_block_kg) / 1000.0
    return crane.max_wind_m_s / float(np.sqrt(max(1.0, sail_m2 / (_PERMITTED_M2_PER_T * hung_t))))


def check_wind(check: Check, site: Site, crane: TowerCrane, component: Component) -> None:
    """Check that the site's wind is permitted for a part, by the outline of its triangles from every side."""
    rules = site.rules
    if not asks_for_wind(rules):
        return
    area_m2 = _shown_m2(component.mesh, component.sail_area_m2)
    check.look(
        area_m2 <= component.sail_area_m2 * (1.0 + _SHARE) + _SHARE,
        f"{component.id}: it shows the wind {area_m2:.3f} m2, not {component.sail_area_m2:.3f} m2",
    )
    check_permitted_wind(check, site, crane, component, max(component.sail_area_m2, area_m2))


def check_permitted_wind(check: Check, site: Site, crane: TowerCrane, component: Component, area_m2: float) -> None:
    """Check that the site's wind is permitted for a part on a crane, with the area that it shows the wind."""
    rules, sail = site.rules, area_m2 * site.rules.drag_coefficient
    most, asked = most_wind_m_s(crane, component, sail), asked_wind_m_s(rules)
    check.measure(max(rules.wind_speed_m_s, asked) / most)
    check.look(
        asked <= most * (1.0 + _SHARE),
        f"{component.id}: {sail:.1f} m2 of sail (drag included) permits {most:.2f} m/s, not {asked:g} m/s",
    )


def check_rope_margin(
    check: Check, site: Site, lift: Lift, present: Sequence[Thing], counts: NDArray[np.uint16], gate: int
) -> None:
    """Check that in transit, within the clearance in plan, nothing is higher than the end of the hook line.

    Exceptions: the first placements straight up from the yard while something is near, and the last moves, which begin
    at placement ``gate``. ``counts`` is how many things occupy each cell, (X, Y, Z).
    """
    assert lift.path_vox is not None
    path, component = lift.path_vox, site.components[lift.component]
    kept_m = site.rules.kept_m("rope_clearance_m", lift.kept)
    reach = whole_cells(kept_m, site.frame)
    if reach == 0:
        return
    hooks = path.astype(np.int64) + np.array(component.hook_offset_vox)
    near: NDArray[np.bool_] = _around_rope(counts, hooks, reach)
    rising = (path[:, :2] == path[0, :2]).all(axis=1) & (np.diff(path[:, 2], prepend=path[0, 2] - 1) == 1)
    leaving = np.logical_and.accumulate(rising & near)
    bad = np.flatnonzero((near & ~leaving)[: gate + 1])
    what = nearest_to_rope(present, hooks[bad[0]], reach) if len(bad) else ""
    check.look(
        not len(bad),
        f"{component.id}: at placement {first_of(bad)} its rope is nearer than {kept_m:g} m to {what}",
        samples=gate + 1,
    )


@kernel
def _around_rope(counts: NDArray[np.uint16], hooks: NDArray[np.int64], reach: int) -> NDArray[np.bool_]:
    """Return (N,) whether anything is within ``reach`` cells, on each axis in plan, of the columns above hook cells."""
    near = np.zeros(hooks.shape[0], np.bool_)
    for n in range(hooks.shape[0]):
        x, y, z = hooks[n, 0], hooks[n, 1], max(hooks[n, 2], 0)
        for i in range(max(0, x - reach), min(counts.shape[0], x + reach + 1)):
            for j in range(max(0, y - reach), min(counts.shape[1], y + reach + 1)):
                for k in range(z, counts.shape[2]):
                    near[n] |= counts[i, j, k] != 0
    return near


@kept
def _shown_m2(mesh: TriangleMesh, claimed_m2: float) -> float:
    """Return the largest area that a mesh shows from the sides; the claim if it shows no more.

    Two bounds decide about most shapes: the outline of the corners' hull and, for a closed surface, half of all faces.
    The union of the triangles decides about the others.
    """
    triangles_m, most_m2 = mesh.triangles_m, claimed_m2 * (1.0 + _SHARE) + _SHARE
    angles = np.arange(0.0, np.pi - 1e-9, _TURN)
    more = [angle for angle in angles if _hull_m2(_from_side(mesh.vertices_m, angle)) > most_m2]
    if more and _closes(mesh):
        more = [angle for angle in more if 0.5 * _areas_m2(_from_side(triangles_m, angle)).sum() > most_m2]
    return max(claimed_m2, *(_outlined_m2(_from_side(triangles_m, angle)) for angle in more), 0.0)


def _from_side(points_m: NDArray[np.float64], angle_rad: float) -> NDArray[np.float64]:
    """Return (..., 2) points in a horizontal view from one side."""
    return np.stack([points_m @ np.array([-np.sin(angle_rad), np.cos(angle_rad), 0.0]), points_m[..., 2]], axis=-1)


def _hull_m2(flat: NDArray[np.float64]) -> float:
    """Return the area of the convex hull of (N, 2) points."""
    return float(shapely.convex_hull(shapely.linestrings(np.concatenate([flat, flat[:1]]))).area)


def _areas_m2(flat: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the (M,) areas of (M, 3, 2) triangles."""
    (ux, uy), (vx, vy) = (flat[:, 1] - flat[:, 0]).T, (flat[:, 2] - flat[:, 0]).T
    areas_m2: NDArray[np.float64] = 0.5 * np.abs(ux * vy - uy * vx)
    return areas_m2


def _outlined_m2(flat: NDArray[np.float64]) -> float:
    """Return the area of the union of (M, 3, 2) triangles, less the rounding of its corners.

    Triangles that are seen edge-on are left out.
    """
    outline = shapely.union_all(shapely.polygons(flat[_areas_m2(flat) > _GRID_M**2]), grid_size=_GRID_M)
    return float(outline.area - _GRID_M * outline.length)


def _closes(mesh: TriangleMesh) -> bool:
    """Return whether every edge belongs to an even number of triangles; corners are the same at exactly one place."""
    corners = point_numbers(mesh.vertices_m)[mesh.faces]
    edges = np.sort(np.stack([corners, np.roll(corners, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    edges = edges[edges[:, 0] != edges[:, 1]]  # an edge without a length parts nothing
    _, times = np.unique(edges[:, 0] * len(mesh.vertices_m) + edges[:, 1], return_counts=True)
    return not (times % 2).any()


def _check_stored(check: Check, component: Component, place: YardPlace) -> None:
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


def check_deliveries(check: Check, site: Site, lifts: Sequence[Lift]) -> None:
    """Check that deliveries come in order, and that each fits onto a truck."""
    loads: dict[int, list[Lift]] = {}
    for lift in lifts:
        if lift.place is not None:
            loads.setdefault(lift.place.delivery, []).append(lift)
    for number, load in loads.items():
        check_truck(check, site, number, load)
    delivery = 0
    for lift in lifts:
        if lift.place is not None:
            check.look(
                lift.place.delivery >= delivery,
                f"{site.components[lift.component].id}: comes with an earlier delivery than the lift before",
            )
            delivery = lift.place.delivery
    missing = min(set(range(delivery + 1)) - loads.keys(), default=None) if loads else None
    check.look(missing is None, f"delivery {delivery} comes, but delivery {missing} does not")


def check_place(check: Check, site: Site, component: Component, place: YardPlace, present: Sequence[Thing]) -> None:
    """Check that a part lies in the yard as it may, and that it can be raised, erected and turned there."""
    cells = place.shape.cells + np.array(place.cell_vox)
    turned = stored_shape(component.shape, place.pose, place.turn)
    check.look(np.array_equal(turned.cells, place.shape.cells), f"{component.id}: stored in another shape than its own")
    inside = bool(((cells >= 0) & (cells < site.shape)).all())
    check.look(inside, f"{component.id}: stored outside the site")
    if not inside:
        return
    check.look(
        place.stack > 0 or stands_on_something(site, place),
        f"{component.id}: is stored neither on the ground nor on structure",
    )
    if component.start_vox is not None:
        check.look(
            place.cell_vox == component.start_vox,
            f"{component.id}: is stored at {place.cell_vox}, the site file says {component.start_vox}",
        )
    else:
        check.look(bool(site.yard[tuple(cells[:, :2].T)].all()), f"{component.id}: stored outside the yard")
    _check_stored(check, component, place)
    low, size = raised_box_vox(component, place)
    raised = "erected" if place.pose is not StoredPose.AS_BUILT else "raised"
    first, last = low.tolist(), (low + size - 1).tolist()
    close = beside(present, first, last)
    check.look(True, "", samples=len(present) - len(close))
    for thing in close:
        hit = ((thing.cells >= low) & (thing.cells < low + size)).all(axis=1)
        check.look(not hit.any(), f"{component.id}: meets {thing.name} while it is {raised}")
    _check_turning(check, site, component, place, present)


def raised_box_vox(component: Component, place: YardPlace) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the lowest cell and the size of the box that a part sweeps while it is raised in the yard."""
    if is_turned_over(component, place):
        low, high = swept_vox(component, place)
        return low, high - low
    size = np.array(erection_size_vox(turned_shape(component.shape, place.turn), place.pose))
    size[2] += place.rise_vox - 1
    return np.array(place.cell_vox), size


def _check_turning(check: Check, site: Site, component: Component, place: YardPlace, present: Sequence[Thing]) -> None:
    """Check that the upright, raised part turns freely about its hook: in its corners' circle, at its height."""
    over = is_turned_over(component, place)
    check.look(
        place.rise_vox == 1 or place.turn != 0 or over,
        f"{component.id}: is raised by {place.rise_vox} cells, yet not turned",
    )
    if place.turn == 0:
        return
    shape, hook = component.shape, component.hook_offset_vox
    centre, radius = turning_circle(component, place)
    lies = np.array(place.cell_vox[:2]) + turned_hook(shape, hook, place.turn)[:2]
    axis = np.array(place.transit_start_vox[:2]) + hook[:2]
    if over:  # it is upright under its head, further along the axis that it lies along
        lies[0 if place.pose is StoredPose.LYING_X else 1] = axis[0 if place.pose is StoredPose.LYING_X else 1]
    check.look(bool((lies == axis).all()), f"{component.id}: does not turn about its hook")
    low = place.cell_vox[2] + place.rise_vox
    high = low + int(shape.cells[:, 2].max()) + 1
    inside = (centre - radius >= -1e-9).all() and (centre + radius <= np.array(site.shape[:2]) + 1e-9).all()
    check.look(bool(inside) and high <= site.shape[2], f"{component.id}: turns beyond the site's boundary")
    # The circle fits into this box of cells.
    reach = int(np.ceil(radius)) + 2
    first, last = [*(axis - reach).tolist(), low], [*(axis + reach).tolist(), high - 1]
    close = beside(present, first, last)
    check.look(True, "", samples=len(present) - len(close))
    for thing in close:
        cells = thing.cells[(thing.cells[:, 2] >= low) & (thing.cells[:, 2] < high)]
        away = np.hypot(*np.maximum(np.abs(cells[:, :2] + 0.5 - centre) - 0.5, 0.0).T)
        check.look(bool((away >= radius - 1e-9).all()), f"{component.id}: meets {thing.name} while it is turned")


def turning_circle(component: Component, place: YardPlace) -> tuple[NDArray[np.float64], float]:
    """Return (2,) the axis and the radius, in cells, of the circle of a part's corners while it is turned."""
    # The hook need not be at the same place within its column for the part as it lies: it moves first.
    x, y = component.hook_aside_vox
    lain = [(x, y), (-y, x), (-x, -y), (y, -x)][place.turn % 4]
    far = np.abs(component.shape.cells[:, :2] - np.array(component.hook_line_vox[:2])) + 0.5
    axis = np.array(place.transit_start_vox[:2]) + component.hook_offset_vox[:2]
    centre: NDArray[np.float64] = axis + 0.5 + np.array(component.hook_aside_vox)
    return centre, float(np.hypot(*far.T).max() + np.hypot(lain[0] - x, lain[1] - y))
