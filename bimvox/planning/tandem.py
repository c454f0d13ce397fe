"""Which two cranes of a site could set a part together that none of them lifts alone: their shares by statics."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.load_chart import capacity_kg
from bimvox.crane.sectors import towards
from bimvox.crane.tower_crane import TowerCrane
from bimvox.site.component import Component
from bimvox.site.default_rules import FlipRules
from bimvox.site.parts import centre_of_mass_m
from bimvox.site.site import Site

MOST_SHARE = FlipRules().most_share
"""Share of each load chart that two ropes with one load use at most."""
_FROM_END = 0.2
"""Where each crane holds the part, as a share of its length from the end: about where a beam bends least."""


@dataclass(frozen=True, slots=True)
class Tandem:
    """Two cranes that hold a part level at its place.

    Attributes:
        cranes: Indices in ``Site.cranes``.
        load_kg: Share of the part's mass on each.
        used: Share of the load chart of each, rigging and hook block included.
        radius_m: Radius of each hook.
        apart_m: Distance of the hooks.
    """

    cranes: tuple[int, int]
    load_kg: tuple[float, float]
    used: tuple[float, float]
    radius_m: tuple[float, float]
    apart_m: float


def tandem_of(site: Site, component: Component) -> Tandem | None:
    """Return the two cranes that use the least of their load charts for a part at its place; None if no two reach it.

    Each holds it at a point near one of its ends. Its place in the yard is not looked at, nor the way between.
    """
    points_m, shares = _points(component)
    apart_m, found = float(np.linalg.norm(points_m[1] - points_m[0])), list[Tandem]()
    if apart_m <= 0.0 or min(shares) <= 0.0:
        return None
    for pair in permutations(range(len(site.cranes)), 2):
        ends = [
            _used(site.cranes[number], point, share * component.mass_kg)
            for number, point, share in zip(pair, points_m, shares, strict=True)
        ]
        (first, near_m), (second, far_m) = ends
        load_kg = (shares[0] * component.mass_kg, shares[1] * component.mass_kg)
        if max(first, second) < np.inf:
            found.append(Tandem(pair, load_kg, (first, second), (near_m, far_m), apart_m))
    return min(found, key=lambda one: (max(one.used), one.cranes), default=None)


def _points(component: Component) -> tuple[NDArray[np.float64], tuple[float, float]]:
    """Return (2, 2) where two cranes hold a part on plan, along its longest direction, and the share of each."""
    plan_m = component.mesh.vertices_m[:, :2]
    found = centre_of_mass_m(component.mesh)
    centre = component.mesh.bounds_m.mean(axis=0)[:2] if found is None else found[:2]
    _, _, axes = np.linalg.svd(plan_m - plan_m.mean(axis=0), full_matrices=False)
    along = axes[0] * (1.0 if tuple(axes[0]) > (0.0, 0.0) else -1.0)
    at_m = (plan_m - centre) @ along
    inwards_m = _FROM_END * float(np.ptp(at_m))
    ends = np.array([float(at_m.min()) + inwards_m, float(at_m.max()) - inwards_m])
    points: NDArray[np.float64] = centre + ends[:, None] * along
    length_m = max(float(ends[1] - ends[0]), 1e-9)
    return points, (float(ends[1]) / length_m, -float(ends[0]) / length_m)


def _used(crane: TowerCrane, point_m: NDArray[np.float64], load_kg: float) -> tuple[float, float]:
    """Return the share of a crane's load chart with the hook above a point, and its radius; infinite out of reach."""
    dx, dy = point_m - np.array(crane.base_m[:2])
    radius_m = float(np.hypot(dx, dy))
    carries_kg = capacity_kg(towards(crane, float(np.arctan2(dy, dx))).chart, radius_m)
    if carries_kg <= 0.0 or not crane.min_radius_m <= radius_m <= crane.jib_length_m:
        return np.inf, radius_m
    return (load_kg + crane.tackle_kg) / carries_kg, radius_m
