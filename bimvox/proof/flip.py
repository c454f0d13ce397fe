"""The proof that a part may be turned over between two hooks: its hooks' shares, their capacities, the ground below it.

The part is turned as a rigid body, by rotations, about where the main hook holds it; forces follow from the balance of
forces and of moments, angle by angle. Nothing is taken from the planner but the two lifting points.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.auxiliary import Auxiliary
from bimvox.crane.tower_crane import TowerCrane
from bimvox.kept import kept
from bimvox.proof.crane.axes import shares_of_capacity
from bimvox.proof.rigging import rigging_kg
from bimvox.records.flip import Flip
from bimvox.records.lift import Lift, YardPlace
from bimvox.records.proof import Check
from bimvox.site.component import Component, StoredPose
from bimvox.site.site import Site

FLIP = "flip"
"""The check of parts that are turned over between two hooks."""

_LYING = np.radians(np.linspace(0.0, 90.0, 181))
"""Angles of the turn, from lying to upright."""
_SAME_M = 2e-3
_SAME_SHARE = 5e-3
_SAME_MASS = 1e-3
"""Shares of the mass may differ by this share of it."""
_COARSEST_DEG = 10.0
_ON_EDGE_VOX = 0.02
"""A corner this little inside a cell does not count as in it: between two of the angles it may be as far out."""


def check_flip(check: Check, site: Site, lift: Lift, component: Component, place: YardPlace) -> None:
    """Check how a part is turned over between two hooks; one that is upended about its foot states nothing."""
    name, flip, crane = component.id, lift.flip, site.crane_of(component)
    if not is_turned_over(component, place):
        check.look(flip is None, f"{name}: states a turn between two hooks, but is not turned over so")
        return
    rules, hook = site.rules.two_hooks, None if crane is None else crane.auxiliary
    check.look(crane is not None and hook is not None, f"{name}: is turned over between two hooks, of a crane with one")
    check.look(rules is not None, f"{name}: is turned over between two hooks, but the rules say nothing about that")
    check.look(flip is not None, f"{name}: is turned over between two hooks, but does not state their shares")
    if crane is None or hook is None or rules is None or flip is None:
        return
    _check_points(check, name, component, place, flip)
    main_kg, auxiliary_kg = _shares_kg(component, place, flip, _LYING)
    _check_shares(check, name, component, place, flip)
    least = min(float(main_kg.min()), float(auxiliary_kg.min()))
    check.look(least >= -_SAME_MASS * component.mass_kg, f"{name}: a hook would have to push it down while it turns")
    limit = rules.most_share if hook.most_share is None else min(rules.most_share, hook.most_share)
    most_kg = float(main_kg.max()), float(auxiliary_kg.max())
    for what, used, stated in _used(site, crane, hook, component, place, most_kg, flip):
        check.measure(used)
        check.look(
            used <= limit + 1e-6,
            f"{name}: between two hooks it uses {100.0 * used:.1f} % of {what}; {100.0 * limit:g} % is permitted",
        )
        check.look(
            abs(used - stated) <= _SAME_SHARE * max(1.0, used),
            f"{name}: between two hooks it uses {100.0 * used:.1f} % of {what}, not {100.0 * stated:.1f} %",
        )
    clear_m = _clear_m(site, component, place)
    check.look(
        clear_m >= rules.clear_m - _SAME_M,
        f"{name}: its foot comes to {clear_m:.2f} m above the ground while it turns; {rules.clear_m:g} m is asked for",
    )
    check.look(
        flip.clear_m <= clear_m + _SAME_M,
        f"{name}: states {flip.clear_m:.2f} m above the ground while it turns, but its foot comes to {clear_m:.2f} m",
    )


def is_turned_over(component: Component, place: YardPlace) -> bool:
    """Return whether a part that lies is turned over between two hooks."""
    return component.flip_rise_vox != 0 and place.pose is not StoredPose.AS_BUILT


def swept_vox(component: Component, place: YardPlace) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the lowest cell, and the one above the highest, of what a part's box sweeps until it is upright."""
    size = np.array(component.shape.size_vox, np.float64)
    corners = size * np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    held = np.array([*(np.array(component.hook_line_vox[:2]) + 0.5), size[2]])
    line = _hook_line_vox(component, place)
    lying, upright = (_turned(corners - held, place, np.array([angle]))[0] for angle in (0.0, np.pi / 2.0))
    level = place.cell_vox[2] + place.rise_vox - lying[:, 2].min()
    hangs = place.cell_vox[2] + place.rise_vox - upright[:, 2].min()
    turning = _turned(corners - held, place, _LYING)
    turning[..., 2] += (level + np.sin(_LYING) * (hangs - level))[:, None]
    turning[..., :2] += line
    lain = [np.array(place.cell_vox), np.array(place.cell_vox) + np.array(place.shape.size_vox)]
    every = np.concatenate([turning.reshape(-1, 3), lain])
    return (
        np.floor(every.min(axis=0) + _ON_EDGE_VOX).astype(np.int64),
        np.ceil(every.max(axis=0) - _ON_EDGE_VOX).astype(np.int64),
    )


def _hook_line_vox(component: Component, place: YardPlace) -> NDArray[np.float64]:
    """Return (2,) where the main hook's rope is on plan, cells: it goes straight up until the part is upright."""
    x, y = component.hook_aside_vox
    aside = [(x, y), (-y, x), (-x, -y), (y, -x)][place.turn % 4]
    line: NDArray[np.float64] = (
        np.add(place.transit_start_vox[:2], component.hook_offset_vox[:2]) + 0.5 + np.array(aside)
    )
    return line


def _turned(points: NDArray[np.float64], place: YardPlace, angle_rad: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (A, N, 3) points of a part, from its place in the building to each angle of its turn; 0 is lying."""
    quarter = np.linalg.matrix_power(np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]), place.turn % 4)
    sin, cos = np.cos(angle_rad), np.sin(angle_rad)  # of the angle from upright
    axis = 0 if place.pose is StoredPose.LYING_X else 1
    tilt = np.zeros((len(angle_rad), 3, 3))
    tilt[:, 1 - axis, 1 - axis] = 1.0
    tilt[:, axis, axis] = tilt[:, 2, 2] = cos
    tilt[:, axis, 2], tilt[:, 2, axis] = sin, -sin
    result: NDArray[np.float64] = np.einsum("aij,nj->ani", tilt @ quarter, points)
    return result


@kept
def centre_of_mass(component: Component) -> NDArray[np.float64]:
    """Return (3,) the centre of the volume that a part's triangles enclose; the middle of its box if there is none."""
    corners = component.mesh.vertices_m[component.mesh.faces]
    middle = corners.reshape(-1, 3).mean(axis=0)
    corners = corners - middle
    sixth = np.linalg.det(corners) / 6.0
    if abs(sixth.sum()) <= 1e-9:
        low, high = component.mesh.bounds_m
        return np.asarray((low + high) / 2.0, np.float64)
    centre: NDArray[np.float64] = middle + (sixth[:, None] * corners.sum(axis=1) / 4.0).sum(axis=0) / sixth.sum()
    return centre


def _check_points(check: Check, name: str, component: Component, place: YardPlace, flip: Flip) -> None:
    """Check that the main hook holds the middle of the head, and the other one the foot end of the upper side."""
    low, high = component.mesh.bounds_m
    centre, main, auxiliary = centre_of_mass(component), np.array(flip.main_m), np.array(flip.auxiliary_m)
    off_m = float(np.abs(main - np.array([*centre[:2], high[2]])).max())
    check.look(off_m <= _SAME_M, f"{name}: its main hook holds it {off_m:.3f} m from the middle of its head")
    upper_m = float(_turned(component.mesh.vertices_m - centre, place, _LYING[:1])[0, :, 2].max())
    below_m = upper_m - float(_turned((auxiliary - centre)[None], place, _LYING[:1])[0, 0, 2])
    check.look(
        abs(below_m) <= _SAME_M,
        f"{name}: its auxiliary hook holds it {below_m:.3f} m below the side that is up as it lies",
    )
    inside = bool((auxiliary >= low - _SAME_M).all() and (auxiliary <= high + _SAME_M).all())
    inside = inside and float(auxiliary[2]) < float(centre[2])
    check.look(inside, f"{name}: its auxiliary hook does not hold its foot end")


def _shares_kg(
    component: Component, place: YardPlace, flip: Flip, angle_rad: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return (A,) the mass on the main and on the auxiliary hook: two vertical ropes in balance with the weight."""
    axis = 0 if place.pose is StoredPose.LYING_X else 1
    points = np.array([flip.main_m, flip.auxiliary_m, centre_of_mass(component)])
    at_m = _turned(points, place, angle_rad)[..., axis]
    # Moments about the one point give the pull at the other; two ropes on one line have no answer.
    apart_m = at_m[:, 1] - at_m[:, 0]
    apart_m[np.abs(apart_m) < 1e-6] = np.nan
    main_kg: NDArray[np.float64] = component.mass_kg * (at_m[:, 1] - at_m[:, 2]) / apart_m
    auxiliary_kg: NDArray[np.float64] = component.mass_kg * (at_m[:, 2] - at_m[:, 0]) / apart_m
    return main_kg, auxiliary_kg


def _check_shares(check: Check, name: str, component: Component, place: YardPlace, flip: Flip) -> None:
    """Check the shares that the plan states."""
    count = len(flip.angle_deg)
    whole = count >= 2 and len(flip.main_kg) == len(flip.auxiliary_kg) == count
    angle = np.array(flip.angle_deg)
    whole = whole and angle[0] == 0.0 and angle[-1] == 90.0 and np.diff(angle).min() > 0.0
    whole = whole and bool(np.diff(angle).max() <= _COARSEST_DEG)
    check.look(whole, f"{name}: does not state the shares of its hooks from lying to upright")
    if not whole:
        return
    slack_kg = _SAME_MASS * component.mass_kg
    sums = np.add(flip.main_kg, flip.auxiliary_kg)
    worst = int(np.argmax(np.abs(sums - component.mass_kg)))
    check.look(
        bool(abs(sums[worst] - component.mass_kg) <= slack_kg),
        f"{name}: at {angle[worst]:g} degrees its hooks carry {sums[worst] / 1000.0:.3f} t together, but it weighs "
        f"{component.mass_kg / 1000.0:.3f} t",
    )
    _, auxiliary_kg = _shares_kg(component, place, flip, np.radians(angle))
    off_kg = np.abs(np.array(flip.auxiliary_kg) - auxiliary_kg)
    worst = int(np.argmax(off_kg))
    check.look(
        bool(off_kg[worst] <= slack_kg),
        f"{name}: at {angle[worst]:g} degrees its auxiliary hook carries {auxiliary_kg[worst] / 1000.0:.3f} t, not "
        f"{flip.auxiliary_kg[worst] / 1000.0:.3f} t",
        samples=count,
    )


def _used(
    site: Site,
    crane: TowerCrane,
    hook: Auxiliary,
    component: Component,
    place: YardPlace,
    most_kg: tuple[float, float],
    flip: Flip,
) -> list[tuple[str, float, float]]:
    """Return what each capacity is called, the share of it that is used, and the share that the plan states."""
    line = np.array(place.transit_start_vox[:2]) + np.array(component.hook_line_vox[:2]) + 0.5
    at_m = site.frame.corner_of([*line, 0.0])[:2] - np.array(crane.base_m[:2])
    radius_m, slew = float(np.hypot(*at_m)), np.array([np.arctan2(at_m[1], at_m[0])])
    gear_kg, second_kg = rigging_kg(crane, component) + crane.hook_block_kg, hook.hook_block_kg + crane.rigging_mass_kg

    def of_chart(at_m: float, hung_kg: float) -> float:
        return float(shares_of_capacity(crane, slew, np.array([at_m]), hung_kg)[0])

    ahead_m = radius_m + hook.ahead_m
    listed = [kg for at, kg in zip(hook.chart.radius_m, hook.chart.capacity_kg, strict=True) if at >= ahead_m - 1e-6]
    second = (most_kg[1] + second_kg) / listed[0] if listed else np.inf
    both_kg = component.mass_kg + gear_kg + second_kg
    return [
        ("the main hook", of_chart(radius_m, most_kg[0] + gear_kg), flip.main_used),
        ("the auxiliary hook", second, flip.auxiliary_used),
        ("the load chart by both", of_chart(max(radius_m, ahead_m), both_kg), flip.both_used),
    ]


def _clear_m(site: Site, component: Component, place: YardPlace) -> float:
    """Return the least height of a part above the ground that it lay on, while its head is hoisted.

    The share of the hoist is the sine of the angle.
    """
    vertices, size_m = component.mesh.vertices_m, site.frame.voxel_size_m
    held = np.array([*centre_of_mass(component)[:2], vertices[:, 2].max()])
    below_m = -_turned(vertices - held, place, _LYING)[..., 2].min(axis=1)
    head_m = below_m[0] + np.sin(_LYING) * (below_m[-1] - below_m[0])
    return place.rise_vox * size_m + float((head_m - below_m).min())
