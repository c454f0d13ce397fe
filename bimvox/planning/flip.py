"""A part that is turned over between two hooks: the share of each, and where the crane may do it.

Both ropes hang straight down, so at every angle the moments about a lifting point balance (two-dimensional statics):
with the centre of mass ``c`` between main hook ``a`` and auxiliary hook ``b``, the auxiliary one carries ``c / b`` of
the mass, both measured level from ``a``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.kinematics import joints_of
from bimvox.crane.load_chart import LoadChart, capacity_kg
from bimvox.crane.sectors import towards
from bimvox.crane.tower_crane import TowerCrane
from bimvox.records.flip import Flip
from bimvox.records.lift import YardPlace
from bimvox.site.component import Component, StoredPose
from bimvox.site.flip_box import is_flipped, least_clear_vox
from bimvox.site.lifting import crane_for, hoisted_kg
from bimvox.site.parts import centre_of_mass_m
from bimvox.site.site import Site
from bimvox.units import mass_text

_ANGLES_DEG = tuple(float(angle) for angle in range(0, 91, 5))
_HELD_AT = 0.25
"""Where the auxiliary hook holds a part, as a share of its height from its foot: a quarter point, as for a slab."""
_STEPS_M = 20.0
"""Radii are rounded up to a twentieth of a metre before their columns are looked at."""


@dataclass(frozen=True, slots=True, eq=False)
class _Turn:
    """A part in the plane of its turn, level distances from the main hook's rope by angle."""

    main_m: NDArray[np.float64]
    auxiliary_m: NDArray[np.float64]
    auxiliary_share: NDArray[np.float64]
    apart_m: NDArray[np.float64]


def _turn_of(component: Component, pose: StoredPose, turn: int) -> _Turn:
    low, high = component.mesh.bounds_m
    found = centre_of_mass_m(component.mesh)
    centre = (low + high) / 2.0 if found is None else found
    # Along this direction in the building, its sides are one above the other as it lies; the lowest is then on top.
    quarter = np.linalg.matrix_power(np.array([[0, 1], [-1, 0]]), turn % 4)
    across = np.array([*(quarter @ (np.array([1, 0]) if pose is StoredPose.LYING_X else np.array([0, 1]))), 0])
    side_m = float((component.mesh.vertices_m @ across).min())
    main = np.array([centre[0], centre[1], high[2]])
    auxiliary = centre + (side_m - float(centre @ across)) * across
    auxiliary[2] = low[2] + _HELD_AT * (high[2] - low[2])
    angle = np.radians(_ANGLES_DEG)

    def level_m(point: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return how far behind the main hook's rope a point is."""
        behind: NDArray[np.float64] = (high[2] - point[2]) * np.cos(angle) + float((main - point) @ across) * np.sin(
            angle
        )
        return behind

    apart_m = level_m(auxiliary)
    return _Turn(main, auxiliary, level_m(centre) / np.maximum(apart_m, 1e-9), apart_m)


def flip_of(site: Site, component: Component, place: YardPlace) -> Flip | None:
    """Return how a part is turned over above its place in the yard; None if it is not, or its crane has no second hook.

    The shares of the capacities may be too large: see ``flip_refused``.
    """
    crane, rules = site.crane_of(component), site.rules.two_hooks
    hook = None if crane is None else crane.auxiliary
    if crane is None or hook is None or rules is None or not is_flipped(component, place.pose):
        return None
    turn = _turn_of(component, place.pose, place.turn)
    auxiliary_kg = component.mass_kg * turn.auxiliary_share
    main_kg = component.mass_kg - auxiliary_kg
    size_m, line = site.frame.voxel_size_m, np.array(component.hook_line_vox[:2]) + 0.5
    start = np.array(place.transit_start_vox)
    at_m = site.frame.corner_of([*(start[:2] + line), 0.0])[:2] - np.array(crane.base_m[:2])
    radius_m, slew_rad = float(np.hypot(*at_m)), float(np.arctan2(at_m[1], at_m[0]))
    chart = towards(crane, slew_rad).chart
    used = _used(crane, chart, component, radius_m, (float(main_kg.max()), float(auxiliary_kg.max())))
    return Flip(
        main_m=_point(turn.main_m),
        auxiliary_m=_point(turn.auxiliary_m),
        angle_deg=_ANGLES_DEG,
        main_kg=tuple(main_kg.tolist()),
        auxiliary_kg=tuple(auxiliary_kg.tolist()),
        main_used=used[0],
        auxiliary_used=used[1],
        both_used=used[2],
        radius_m=radius_m,
        clear_m=_clear_m(component, place, size_m),
        lean_rad=_lean_rad(site, crane, component, place, turn, (radius_m, slew_rad)),
    )


def _point(at_m: NDArray[np.float64]) -> tuple[float, float, float]:
    x, y, z = (round(n, 6) for n in at_m.tolist())
    return (x, y, z)


def _used(
    crane: TowerCrane, chart: LoadChart, component: Component, radius_m: float, most_kg: tuple[float, float]
) -> tuple[float, float, float]:
    """Return the shares of the capacity of the main hook, of the auxiliary one, and of the chart by both.

    ``chart`` holds for the main hook at ``radius_m``; ``most_kg``: the largest share of the mass on each hook.
    """
    hook = crane.auxiliary
    assert hook is not None
    gear_kg, (main_kg, auxiliary_kg) = hoisted_kg(crane, component) - component.mass_kg, most_kg
    # The usual slings of the crane hang on the auxiliary hook; the load's own gear hangs on the main one.
    second_kg = hook.hook_block_kg + crane.rigging_mass_kg
    carried = (
        (main_kg + gear_kg, capacity_kg(chart, radius_m)),
        (auxiliary_kg + second_kg, capacity_kg(hook.chart, radius_m + hook.ahead_m)),
        (component.mass_kg + gear_kg + second_kg, capacity_kg(chart, radius_m + max(hook.ahead_m, 0.0))),
    )
    main, second, both = (kg / carries_kg if carries_kg > 0.0 else 99.0 for kg, carries_kg in carried)
    return main, second, both


def most_used(site: Site, crane: TowerCrane) -> float:
    """Return the share of the capacities that a crane may use while both of its hooks carry a part."""
    rules, hook = site.rules.two_hooks, crane.auxiliary
    assert rules is not None
    assert hook is not None
    return rules.most_share if hook.most_share is None else min(rules.most_share, hook.most_share)


def flip_columns(site: Site, crane: TowerCrane, component: Component) -> NDArray[np.bool_]:
    """Return (X, Y) the columns above which a crane may turn a part over between its two hooks."""
    if crane.auxiliary is None:
        return np.ones(site.shape[:2], np.bool_)  # the reason is given by ``flip_refused``
    columns = np.moveaxis(np.indices(site.shape[:2]), 0, -1).reshape(-1, 2)
    at_m = np.array(site.frame.origin_m[:2]) + site.frame.voxel_size_m * (
        columns + 0.5 + np.array(component.hook_aside_vox)
    )
    radius_m = np.hypot(*(at_m - np.array(crane.base_m[:2])).T)
    poses = (StoredPose.LYING_X, StoredPose.LYING_Y) if component.stored_pose is None else (component.stored_pose,)
    turns = (0, 1) if component.stored_turn is None else (component.stored_turn,)
    shares = [_turn_of(component, pose, turn).auxiliary_share for pose in poses for turn in turns]
    most_kg = (
        component.mass_kg * (1.0 - min(float(share.min()) for share in shares)),
        component.mass_kg * max(float(share.max()) for share in shares),
    )
    limit = most_used(site, crane)
    steps, which = np.unique(np.ceil(radius_m * _STEPS_M), return_inverse=True)
    used = [max(_used(crane, crane.chart, component, step / _STEPS_M, most_kg)) for step in steps.tolist()]
    good: NDArray[np.bool_] = (np.array(used) <= limit)[which].reshape(site.shape[:2])
    return good


def flip_refused(site: Site, component: Component, place: YardPlace) -> str | None:
    """Return why a part cannot be turned over between two hooks above its place; None if it can, or need not."""
    crane = site.crane_of(component)
    if crane is None or not is_flipped(component, place.pose):
        return None
    flip = flip_of(site, component, place)
    if flip is None:
        return no_second_hook(crane)
    limit = most_used(site, crane)
    if flip.used <= limit:
        return None
    what, used = max(
        (
            ("the main hook", flip.main_used),
            ("the auxiliary hook", flip.auxiliary_used),
            ("its load chart", flip.both_used),
        ),
        key=lambda one: one[1],
    )
    return (
        f"between two hooks it uses {100.0 * used:.0f} % of {what} of {crane.name} at {flip.radius_m:.1f} m, and "
        f"{100.0 * limit:g} % is permitted: {mass_text(max(flip.main_kg))} on the main hook at most, "
        f"{mass_text(max(flip.auxiliary_kg))} on the auxiliary one"
    )


def no_second_hook(crane: TowerCrane) -> str:
    """Return that a crane cannot turn a part over."""
    return (
        f"it is turned over between two hooks, and {crane.name} has no auxiliary one ([auxiliary] of its machine file)"
    )


def _clear_m(component: Component, place: YardPlace, size_m: float) -> float:
    """Return the least distance of a part from the ground that it lay on: its lower edge sinks while it turns."""
    return round(size_m * least_clear_vox(component, place.pose, place.turn, place.rise_vox), 6)


def _lean_rad(
    site: Site,
    crane: TowerCrane,
    component: Component,
    place: YardPlace,
    turn: _Turn,
    hook: tuple[float, float],
) -> float:
    """Return the largest angle of a rope to the vertical.

    The ropes part by what the lifting points are further apart than they, or nearer, each by the share of the other
    hook, so that their level pulls balance.
    """
    assert crane.auxiliary is not None
    radius_m, slew_rad = hook
    ahead = crane.auxiliary.ahead_m * np.array([np.cos(slew_rad), np.sin(slew_rad)])
    foot = np.array([-1.0, 0.0] if place.pose is StoredPose.LYING_X else [0.0, -1.0])
    off_m = np.linalg.norm(turn.apart_m[:, None] * foot - ahead, axis=1)
    rigged, size_m = crane_for(site, crane, component), site.frame.voxel_size_m
    top_m = site.frame.origin_m[2] + size_m * (place.transit_start_vox[2] + component.shape.size_vox[2])
    upright_m = top_m + rigged.sling_m
    hoist_m = float(component.mesh.bounds_m[1, 2] - component.mesh.bounds_m[0, 2]) * (
        1.0 - np.sin(np.radians(_ANGLES_DEG))
    )
    axes = np.stack([np.full(len(off_m), slew_rad), np.full(len(off_m), radius_m), upright_m - hoist_m], axis=1)
    rope_m = np.maximum(joints_of(rigged, axes)[:, 2], 0.5)
    share = np.maximum(turn.auxiliary_share, 1.0 - turn.auxiliary_share)
    return round(float(np.arctan(share * off_m / rope_m).max()), 6)
