"""A crane with its load on the rope: the pendulum's length and period, and how it swings while the crane moves.

The load is a point on a rope of changing length l, for small angles and without damping (real damping only helps). With
p the point of the jib that it hangs from and q the load, both on the plan in the site's frame, which does not turn (so
that slewing needs no extra terms): q'' = (g - l'') / l (p - q).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import inline_kernel, kernel
from bimvox.crane.tower_crane import TowerCrane, tip_height_m
from bimvox.motion.swept import LoadFrame, load_frame, swaying_is_free
from bimvox.site.collision import CollisionSpace
from bimvox.site.component import Component
from bimvox.site.lifting import crane_for
from bimvox.site.site import Site, SwingRule

GRAVITY_M_S2 = 9.80665
SHORTEST_M = 0.5
"""No pendulum is shorter."""


def pendulum_length_m(crane: TowerCrane, height_m: float, below_hook_m: float, radius_m: float | None = None) -> float:
    """Return the distance from the rope exit down to the middle of the load, at least 0.5 m.

    Args:
        crane: The crane.
        height_m: Height of the hook above the site's z = 0.
        below_hook_m: From the hook down to the middle of the load.
        radius_m: Radius of the hook, which determines the height of a luffing jib's tip; None: the highest tip.
    """
    exit_m = crane.jib_height_m
    if crane.luffing is not None and radius_m is not None:
        exit_m = float(tip_height_m(crane.luffing, np.array([radius_m]))[0])
    return max(SHORTEST_M, exit_m - height_m + below_hook_m)


def pendulum_lengths_m(crane: TowerCrane, axes: NDArray[np.float64], below_hook_m: float) -> NDArray[np.float64]:
    """Return the (N,) pendulum lengths at (N, 3) hook poses (slew, radius, height); see :func:`pendulum_length_m`."""
    exit_m = crane.jib_height_m if crane.luffing is None else tip_height_m(crane.luffing, axes[:, 1])
    lengths: NDArray[np.float64] = np.maximum(SHORTEST_M, exit_m - axes[:, 2] + below_hook_m)
    return lengths


def half_period_s(length_m: float) -> float:
    """Return half the period of a pendulum, for small angles."""
    return pi * sqrt(length_m / GRAVITY_M_S2)


PLANNED_RESIDUAL_M = 0.04
"""A planned load that swings no further than this to a side is at rest. The proof, which integrates the samples of the
log with a pendulum of its own, allows 0.05 m."""

STEP_S = 0.05
"""Largest step of the integration."""


class Pendulum(NamedTuple):
    """The load on the hook.

    Attributes:
        below_hook_m: Distance from the hook down to the middle of the load.
    """

    below_hook_m: float


@dataclass(frozen=True, slots=True, eq=False)
class Swing:
    """A load's offset from its rest position.

    Attributes:
        offset_m: (N, 2) float64 on the plan, in the site's frame.
        amplitude_m: (N,) float64 its amplitude if the crane stood still from then on.
    """

    offset_m: NDArray[np.float64]
    amplitude_m: NDArray[np.float64]

    def beyond_m(self, rest_m: float) -> NDArray[np.float64]:
        """Return (N, 2) the offsets minus what counts as rest; 0 if the load swings less than that."""
        beyond: NDArray[np.float64] = _beyond(self.offset_m, rest_m)
        return beyond


def pendulum_of(site: Site, crane: TowerCrane, component: Component | None) -> Pendulum | None:
    """Return a load (None for the empty hook) on a crane's hook as a pendulum; None if swing is off."""
    if site.rules.swing is SwingRule.OFF:
        return None
    half_m = 0.0 if component is None else 0.5 * component.shape.size_vox[2] * site.frame.voxel_size_m
    return Pendulum(crane_for(site, crane, component).sling_m + half_m)


class Hanging(NamedTuple):
    """A load on the rope of a crane as kernels take it.

    Attributes:
        swings: Whether its swing counts.
        x_m: The slewing axis.
        y_m: The slewing axis.
        exit_m: Height of the rope's exit; of a luffing jib's pivot.
        pivot_m: Radius of that pivot.
        jib_m: Length of a luffing jib; 0 for a horizontal one.
        below_hook_m: As in ``Pendulum``.
        gravity_m_s2: Gravity.
    """

    swings: bool
    x_m: float
    y_m: float
    exit_m: float
    pivot_m: float
    jib_m: float
    below_hook_m: float
    gravity_m_s2: float


def hanging_on(crane: TowerCrane, pendulum: Pendulum | None) -> Hanging:
    """Return a load on a crane's rope as kernels take it; with None it does not swing."""
    x_m, y_m, jib = *crane.base_m[:2], crane.luffing
    below_hook_m = 0.0 if pendulum is None else pendulum.below_hook_m
    exits = (crane.jib_height_m, 0.0, 0.0) if jib is None else (jib.pivot_height_m, jib.pivot_offset_m, jib.length_m)
    return Hanging(pendulum is not None, x_m, y_m, *exits, below_hook_m, GRAVITY_M_S2)


def swing_of(crane: TowerCrane, axes: NDArray[np.float64], step_s: float, pendulum: Pendulum) -> Swing:
    """Return the swing of a load that is at rest at the start, for (N, 3) axes ``step_s`` apart, ``STEP_S`` at most."""
    return Swing(*_swing(axes, hanging_on(crane, pendulum), step_s, True))


@kernel
def left_m(axes: NDArray[np.float64], hanging: Hanging, step_s: float) -> NDArray[np.float64]:
    """Return (4,) position and speed of the load of ``swing_of`` at the end, each as the amplitude it leads to, m."""
    offset_m, _ = _swing(axes, hanging, step_s, False)
    left, per_s = np.empty(4), np.sqrt(hanging.gravity_m_s2 / _length_m(hanging, axes[-1, 1], axes[-1, 2]))
    left[:2] = offset_m[-1]
    left[2:] = (offset_m[-1] - offset_m[-2]) / step_s / per_s
    return left


@kernel
def sways_free(
    space: CollisionSpace, load: LoadFrame, axes: NDArray[np.float64], hanging: Hanging, step_s: float
) -> bool:
    """Return whether a load that is at rest at the start swings into nothing, to either side, in a planned motion.

    Args:
        space: The collision rule.
        load: How hook poses and reference cells correspond.
        axes: (N, 3) slew, radius, height, ``step_s`` apart.
        hanging: The load on its rope.
        step_s: As for ``swing_of``.
    """
    beyond_m = _beyond(_swing(axes, hanging, step_s, False)[0], PLANNED_RESIDUAL_M)
    swings = (beyond_m[:, 0] != 0.0) | (beyond_m[:, 1] != 0.0)
    return swaying_is_free(space, load, axes, beyond_m / load.voxel_size_m, swings, True) < 0


@inline_kernel
def _length_m(hanging: Hanging, radius_m: float, height_m: float) -> float:
    """Return what ``pendulum_lengths_m`` does for one hook pose."""
    exit_m, far_m = hanging.exit_m, radius_m - hanging.pivot_m
    if hanging.jib_m > 0.0:
        exit_m += np.sqrt(max(hanging.jib_m * hanging.jib_m - far_m * far_m, 0.0))
    return max(SHORTEST_M, exit_m - height_m + hanging.below_hook_m)


@kernel
def _points(axes: NDArray[np.float64], x_m: float, y_m: float) -> NDArray[np.float64]:
    """Return (N, 2) the hook on the plan, as ``hook_of`` has it."""
    points = np.empty((axes.shape[0], 2))
    cos, sin = 1.0, 0.0
    for i in range(axes.shape[0]):
        if i == 0 or axes[i, 0] != axes[i - 1, 0]:  # most of the time is hoisting
            cos, sin = np.cos(axes[i, 0]), np.sin(axes[i, 0])
        points[i, 0] = x_m + axes[i, 1] * cos
        points[i, 1] = y_m + axes[i, 1] * sin
    return points


@kernel
def _swing(
    axes: NDArray[np.float64], hanging: Hanging, step_s: float, with_amplitude: bool
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Velocity Verlet over evenly spaced samples; the amplitudes, if wanted, otherwise zeros for none."""
    point_m = _points(axes, hanging.x_m, hanging.y_m)
    n = point_m.shape[0]
    offset, amplitude = np.zeros((n, 2)), np.zeros(n if with_amplitude else 0)
    qx, qy = point_m[0, 0], point_m[0, 1]
    vx, vy, ax, ay = 0.0, 0.0, 0.0, 0.0
    half = 0.5 * step_s
    shorter_m = length_m = _length_m(hanging, axes[0, 1], axes[0, 2])
    longer_m = _length_m(hanging, axes[min(1, n - 1), 1], axes[min(1, n - 1), 2])
    for i in range(1, n):
        qx += step_s * (vx + half * ax)
        qy += step_s * (vy + half * ay)
        after = min(i + 1, n - 1)
        shorter_m, length_m = length_m, longer_m
        bend = 0.0
        if after > i:
            longer_m = _length_m(hanging, axes[after, 1], axes[after, 2])
            bend = (longer_m - 2.0 * length_m + shorter_m) / step_s**2
        stiffness = (hanging.gravity_m_s2 - bend) / length_m
        x, y = qx - point_m[i, 0], qy - point_m[i, 1]
        vx += half * (ax - stiffness * x)
        vy += half * (ay - stiffness * y)
        ax, ay = -stiffness * x, -stiffness * y
        offset[i, 0], offset[i, 1] = x, y
        if not with_amplitude:
            continue
        span_s = step_s * (after - i + 1)
        ux = vx - (point_m[after, 0] - point_m[i - 1, 0]) / span_s
        uy = vy - (point_m[after, 1] - point_m[i - 1, 1]) / span_s
        amplitude[i] = np.sqrt(x * x + y * y + (ux * ux + uy * uy) / max(stiffness, 1e-9))
    return offset, amplitude


@kernel
def _beyond(offset_m: NDArray[np.float64], rest_m: float) -> NDArray[np.float64]:
    beyond = np.empty_like(offset_m)
    for i in range(offset_m.shape[0]):
        x, y = offset_m[i, 0], offset_m[i, 1]
        share = max(0.0, 1.0 - rest_m / max(np.sqrt(x * x + y * y), 1e-12))
        beyond[i, 0], beyond[i, 1] = x * share, y * share
    return beyond


HOOK_OFFSET = np.zeros(3, np.int32)
"""The empty hook is one cell at the lower end of its slings."""


class RiggedCrane(NamedTuple):
    """A crane with its load.

    Attributes:
        crane: The crane in the gear of the load, with its slings.
        load: How hook poses and reference cells correspond.
        pendulum: The load as a pendulum; None if its swing is not checked.
        sample_period_s: Largest time between samples of its trajectories.
    """

    crane: TowerCrane
    load: LoadFrame
    pendulum: Pendulum | None
    sample_period_s: float


def rigged_crane(site: Site, crane: TowerCrane, component: Component | None) -> RiggedCrane:
    """Return one of a site's cranes with a component on its hook; with the empty hook (usual slings) if None."""
    rigged = crane_for(site, crane, component)
    line_vox = HOOK_OFFSET if component is None else component.hook_line_vox
    load = load_frame(rigged, site.frame, line_vox)
    return RiggedCrane(rigged, load, pendulum_of(site, crane, component), site.rules.sample_period_s)
