"""The paper's observations by name: their spaces, and one kernel that writes any of them.

``paper`` is a map over (x, y) of six channels, heights in cells. A height is the index k of the highest cell of an
object: 0 for the slab, 1 for a component in the yard, 2 for an obstruction two cells high, 5 for a column of four cells
that hangs at k = 2. If several objects of one channel are stacked, the highest counts. The channels:

0. ``Zi`` height of an obstruction, or of a stored component.
1. ``f`` 1 below the component in transit once it is late, otherwise 0.
2. ``Zt`` height of the component in transit.
3. ``Ztar`` height of the target of the component in transit; assembled components keep theirs.
4. ``arrived`` 1 at assembled components.
5. ``count`` the number of assembled components, at each of them.

With several components only the target of the one in transit is shown. Otherwise drawn targets could not be told apart.

``egocentric`` tells what is free around the component, the way to the goal, and the last action. It is a window of
``WINDOW`` cells around the component on each of four levels (scale 1, 2, 4, 8):

* scale 1: whether the component can be at each neighbouring placement, by the one collision rule
  (:func:`bimvox.site.collision.placement_is_free`): 0 free, 1 blocked;
* scale s: one cell represents the block of placements s * (i, j, k) +- s/2, answered by
  :func:`bimvox.env.observation.swept_fill`. 0: every placement is free. 1: none is, or the hook is not allowed at
  the middle one. In between: the filled share of the swept box, raised above ``_PARTLY`` so that a thin wall shows.

Its size depends neither on the site nor on the component, so one network serves every lift. It holds nothing of the
distance field, which belongs to the teacher.
"""

from __future__ import annotations

from typing import NamedTuple

import gymnasium
import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel, leaf_kernel
from bimvox.env.actions import ACTION_COUNT, named
from bimvox.env.dynamics import LiftState
from bimvox.env.observation import WAY_SIZE, Corner, bounding_box, swept_fill, write_goal
from bimvox.paper.env.dynamics import clearance_of, is_late, length_of, lying, may_be
from bimvox.paper.env.spec import STORED_LAYER, PaperSpec
from bimvox.paper.env.state import PaperState, SiteState, SpecArrays, lift_state
from bimvox.site.collision import CollisionSpace, placement_is_free

_CHANNELS = 6
_INITIAL_HEIGHT, _LATE, _TRANSIT_HEIGHT, _TARGET_HEIGHT, _ARRIVED, _COUNT = range(_CHANNELS)


@leaf_kernel
def _write_map(rules: SpecArrays, site: SiteState, state: PaperState, out: NDArray[np.float32]) -> None:
    """Write the map of a state into ``out``, (X, Y, 6) float32."""
    out[:] = 0.0
    for m in range(site.obstructions.shape[0]):
        x0, y0, _, x1, y1, z1 = site.obstructions[m]
        _raise_to(out, x0, y0, x1, y1, _INITIAL_HEIGHT, z1 - 1)
    count = rules.boxes.shape[0]
    for i in range(count):
        if i > state.component:
            x, y = site.stored[i, 0], site.stored[i, 1]
            dx, dy = lying(length_of(rules, i), site.stored[i, 2])
            _raise_to(out, x, y, x + dx, y + dy, _INITIAL_HEIGHT, STORED_LAYER)
        else:
            x, y, z = site.target[i]
            dx, dy, dz = rules.boxes[i, 3:]
            _raise_to(out, x, y, x + dx, y + dy, _TARGET_HEIGHT, z + dz - 1)
            if i < state.component:
                _raise_to(out, x, y, x + dx, y + dy, _ARRIVED, 1)
                _raise_to(out, x, y, x + dx, y + dy, _COUNT, state.component)
    if state.component < count:
        i = state.component
        late = 1.0 if is_late(rules, state) else 0.0
        for x in range(state.x, state.x + rules.boxes[i, 3]):
            for y in range(state.y, state.y + rules.boxes[i, 4]):
                out[x, y, _LATE] = late
                out[x, y, _TRANSIT_HEIGHT] = state.z + rules.boxes[i, 5] - 1


@leaf_kernel
def _raise_to(out: NDArray[np.float32], x0: int, y0: int, x1: int, y1: int, channel: int, value: int) -> None:
    for x in range(x0, x1):
        for y in range(y0, y1):
            out[x, y, channel] = max(out[x, y, channel], np.float32(value))


WINDOW = (7, 7, 5)
"""Cells of the window along x, y, z; odd, so that the component is in the middle."""

SCALES = (1, 2, 4, 8)
"""Cells of the site per cell of the window, one level each."""

_PARTLY = 0.25
"""Least value of a coarse cell whose placements are neither all free nor all blocked."""

WINDOW_SIZE = WINDOW[0] * WINDOW[1] * WINDOW[2]
OBSERVATION_SIZE = WINDOW_SIZE * len(SCALES) + WAY_SIZE + ACTION_COUNT


@leaf_kernel
def observe(space: CollisionSpace, target: NDArray[np.int32], state: LiftState, out: NDArray[np.float32]) -> None:
    """Write the observation of one lift into ``out``, (OBSERVATION_SIZE,) float32 in [-1, 1]."""
    x, y, z = state.x, state.y, state.z
    low, high = bounding_box(space.boxes)
    n = 0
    for scale in SCALES:
        for i in range(-(WINDOW[0] // 2), WINDOW[0] // 2 + 1):
            for j in range(-(WINDOW[1] // 2), WINDOW[1] // 2 + 1):
                for k in range(-(WINDOW[2] // 2), WINDOW[2] // 2 + 1):
                    u, v, w = x + scale * i, y + scale * j, z + scale * k
                    if scale == 1:
                        out[n] = 0.0 if placement_is_free(space, u, v, w) else 1.0
                    else:
                        out[n] = _coarse_cell(space, low, high, (u, v, w), scale // 2)
                    n += 1
    write_goal(target[0] - x, target[1] - y, target[2] - z, out[n : n + WAY_SIZE])
    n += WAY_SIZE
    for action in range(ACTION_COUNT):
        out[n + action] = 1.0 if state.last_action == action else 0.0


@leaf_kernel
def _coarse_cell(space: CollisionSpace, low: Corner, high: Corner, cell: Corner, reach: int) -> float:
    """Return how blocked the placements within ``reach`` of a cell are."""
    filled, volume = swept_fill(space, low, high, cell, (reach, reach, reach))
    if volume == 0:
        return 1.0
    if filled == 0:
        return 0.0
    return float(_PARTLY + (1.0 - _PARTLY) * filled / volume)


_WINDOW_WIDTH = 11
"""Cells of the window along x and y; odd, so that the component is in the middle."""

WINDOW_CELLS = _WINDOW_WIDTH * _WINDOW_WIDTH
_WINDOW_OBSERVATION_SIZE = 2 * WINDOW_CELLS + 2 + 3


@leaf_kernel
def _write_window(rules: SpecArrays, site: SiteState, state: PaperState, out: NDArray[np.float32]) -> None:
    """Write the window into ``out``, (247,) float32 in [-1, 1].

    In order: 11 x 11 whether the component is blocked there at its current height; 11 x 11 whether its target is there
    at any height; whether up and down are blocked; the offset of the target along x, y, z as a share of the site. Once
    everything is assembled, it shows the last component.
    """
    i = min(state.component, rules.boxes.shape[0] - 1)
    x, y, z = state.x, state.y, state.z
    half = _WINDOW_WIDTH // 2
    n = 0
    for u in range(x - half, x + half + 1):
        for v in range(y - half, y + half + 1):
            out[n] = 0.0 if may_be(rules, site, i, u, v, z) else 1.0
            out[WINDOW_CELLS + n] = 1.0 if u == site.target[i, 0] and v == site.target[i, 1] else 0.0
            n += 1
    out[2 * WINDOW_CELLS] = 0.0 if may_be(rules, site, i, x, y, z + 1) else 1.0
    out[2 * WINDOW_CELLS + 1] = 0.0 if may_be(rules, site, i, x, y, z - 1) else 1.0
    nx, ny, nz = site.cells.shape
    out[2 * WINDOW_CELLS + 2] = (site.target[i, 0] - x) / nx
    out[2 * WINDOW_CELLS + 3] = (site.target[i, 1] - y) / ny
    out[2 * WINDOW_CELLS + 4] = (site.target[i, 2] - z) / nz


_PAPER_MAP, _EGOCENTRIC, _WINDOW = range(3)


class _Observation(NamedTuple):
    """The kernel that writes an observation, and whether the paper's map is returned as a vector."""

    code: int
    flat: bool = True


OBSERVATIONS: dict[str, _Observation] = {
    "paper": _Observation(_PAPER_MAP, flat=False),
    "paper_flat": _Observation(_PAPER_MAP),
    "egocentric": _Observation(_EGOCENTRIC),
    "window": _Observation(_WINDOW),
}
"""``paper``: the paper's map, (X, Y, 6). ``paper_flat``: the same numbers as a vector, C order; stable-baselines3 takes
every three-dimensional box for an image. ``egocentric``: the pyramid of ``bimvox.paper.env.observation`` around the
component in transit. ``window``: ``bimvox.paper.env.observation``."""


def observation_space(spec: PaperSpec, name: str) -> gymnasium.spaces.Box:
    """Return the space of an observation.

    Bounds of the paper's channels: heights 0 .. Z - 1, flag and arrived 0 .. 1, count 0 .. n. The others lie in
    [-1, 1].

    Raises:
        ValueError: There is no observation of that name.
    """
    observation = named("observation", name, OBSERVATIONS)
    if observation.code != _PAPER_MAP:
        size = OBSERVATION_SIZE if observation.code == _EGOCENTRIC else _WINDOW_OBSERVATION_SIZE
        return gymnasium.spaces.Box(-1.0, 1.0, (size,), np.float32)
    nx, ny, nz = spec.shape
    top = nz - 1
    high = np.broadcast_to(np.array([top, 1, top, top, 1, spec.count], np.float32), (nx, ny, _CHANNELS))
    high = np.ascontiguousarray(high.reshape(-1) if observation.flat else high)
    return gymnasium.spaces.Box(np.zeros_like(high), high, dtype=np.float32)


@kernel
def write_observation(
    code: int, rules: SpecArrays, site: SiteState, state: PaperState, out: NDArray[np.float32]
) -> None:
    """Write the observation of a code into ``out``, (size,) float32, contiguous."""
    if code == _PAPER_MAP:
        nx, ny, _ = site.cells.shape
        _write_map(rules, site, state, out.reshape((nx, ny, _CHANNELS)))
    elif code == _EGOCENTRIC:
        i = min(state.component, rules.boxes.shape[0] - 1)
        observe(clearance_of(rules, site, i), site.target[i], lift_state(state), out)
    else:
        _write_window(rules, site, state, out)
