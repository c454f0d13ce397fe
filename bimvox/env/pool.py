"""Many problems in flat arrays, so that one kernel can step lifts on different sites; and where episodes begin."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel, leaf_kernel
from bimvox.env.problem import LiftProblem
from bimvox.site.collision import CollisionSpace

S = TypeVar("S", bound=np.generic)


class ProblemPool(NamedTuple):
    """P problems, as a tuple for kernels. Tables and hook maps that problems share are held once.

    Attributes:
        tables: (sum of table sizes,) int32, the summed-area tables one after the other.
        table_start: (P,) int64 where each problem's table begins.
        table_shape: (P, 3) int64.
        boxes: (sum of boxes, 6) int32.
        boxes_start: (P + 1,) int64.
        hook_offset: (P, 3) int32.
        hook_floors: (sum of X * Y,) int32.
        hook_floor_start: (P,) int64.
        hook_ceilings: (sum of X * Y,) int32; empty for a problem without a ceiling.
        hook_ceiling_start: (P,) int64.
        hook_ceiling_shape: (P, 2) int64.
        cleared_low: (P, 3) int32.
        cleared: (sum of window sizes,) bool.
        cleared_start: (P,) int64.
        cleared_shape: (P, 3) int64.
        target: (P, 3) int32.
        starts: (sum of starts, 3) int32.
        starts_start: (P + 1,) int64.
        distances: (sum of field sizes,) int16; empty if the problems have none.
        distance_start: (P,) int64.
    """

    tables: NDArray[np.int32]
    table_start: NDArray[np.int64]
    table_shape: NDArray[np.int64]
    boxes: NDArray[np.int32]
    boxes_start: NDArray[np.int64]
    hook_offset: NDArray[np.int32]
    hook_floors: NDArray[np.int32]
    hook_floor_start: NDArray[np.int64]
    hook_ceilings: NDArray[np.int32]
    hook_ceiling_start: NDArray[np.int64]
    hook_ceiling_shape: NDArray[np.int64]
    cleared_low: NDArray[np.int32]
    cleared: NDArray[np.bool_]
    cleared_start: NDArray[np.int64]
    cleared_shape: NDArray[np.int64]
    target: NDArray[np.int32]
    starts: NDArray[np.int32]
    starts_start: NDArray[np.int64]
    distances: NDArray[np.int16]
    distance_start: NDArray[np.int64]


def pool_of(problems: Sequence[LiftProblem], *, with_distances: bool) -> ProblemPool:
    """Return problems as one pool.

    Args:
        problems: At least one.
        with_distances: Whether to include the distance fields, for training; then every problem must have one.

    Raises:
        ValueError: There is no problem, or one lacks the distance field that is needed.
    """
    if not problems:
        raise ValueError("a pool needs at least one problem")
    if with_distances and any(problem.distance is None for problem in problems):
        raise ValueError("every problem needs a distance field: make it with training_problem()")
    clearances = [problem.space for problem in problems]
    tables, table_start = _packed([c.table for c in clearances], np.int32)
    floors, floor_start = _packed([c.hook_floor for c in clearances], np.int32)
    ceilings, ceiling_start = _packed([c.hook_ceiling for c in clearances], np.int32)
    cleared, cleared_start = _packed([c.cleared for c in clearances], np.bool_)
    fields = [p.distance for p in problems if p.distance is not None] if with_distances else []
    distances, distance_start = _packed(fields, np.int16)
    return ProblemPool(
        tables=tables,
        table_start=table_start,
        table_shape=np.array([c.table.shape for c in clearances], np.int64),
        boxes=np.concatenate([c.boxes for c in clearances]).astype(np.int32),
        boxes_start=_bounds([len(c.boxes) for c in clearances]),
        hook_offset=np.array([c.hook_offset for c in clearances], np.int32),
        hook_floors=floors,
        hook_floor_start=floor_start,
        hook_ceilings=ceilings,
        hook_ceiling_start=ceiling_start,
        hook_ceiling_shape=np.array([c.hook_ceiling.shape for c in clearances], np.int64),
        cleared_low=np.array([c.cleared_low for c in clearances], np.int32),
        cleared=cleared,
        cleared_start=cleared_start,
        cleared_shape=np.array([c.cleared.shape for c in clearances], np.int64),
        target=np.array([p.target_vox for p in problems], np.int32),
        starts=np.concatenate([p.starts_vox for p in problems]).astype(np.int32),
        starts_start=_bounds([len(p.starts_vox) for p in problems]),
        distances=distances,
        distance_start=distance_start,
    )


@kernel
def pooled_clearance(pool: ProblemPool, p: int) -> CollisionSpace:
    """Return the collision rule of problem ``p``, as views."""
    nx, ny, nz = pool.table_shape[p]
    start = pool.table_start[p]
    table = pool.tables[start : start + nx * ny * nz].reshape((nx, ny, nz))
    start = pool.hook_floor_start[p]
    hook_floor = pool.hook_floors[start : start + (nx - 1) * (ny - 1)].reshape((nx - 1, ny - 1))
    a, b, c = pool.cleared_shape[p]
    start = pool.cleared_start[p]
    cleared = pool.cleared[start : start + a * b * c].reshape((a, b, c))
    a, b = pool.hook_ceiling_shape[p]
    start = pool.hook_ceiling_start[p]
    hook_ceiling = pool.hook_ceilings[start : start + a * b].reshape((a, b))
    boxes = pool.boxes[pool.boxes_start[p] : pool.boxes_start[p + 1]]
    return CollisionSpace(table, boxes, pool.hook_offset[p], hook_floor, pool.cleared_low[p], cleared, hook_ceiling)


@leaf_kernel
def pooled_distance(pool: ProblemPool, p: int, x: int, y: int, z: int) -> int:
    """Return the moves to the target of problem ``p`` from a reference cell inside the site; 0 without a field."""
    if pool.distances.size == 0:
        return 0
    ny, nz = pool.table_shape[p, 1] - 1, pool.table_shape[p, 2] - 1
    return int(pool.distances[pool.distance_start[p] + (x * ny + y) * nz + z])


def _packed(arrays: Sequence[NDArray[S]], dtype: type[S]) -> tuple[NDArray[S], NDArray[np.int64]]:
    """Return arrays flat, one after the other, equal objects once, and where each begins."""
    first: dict[int, int] = {}
    unique: list[NDArray[S]] = []
    starts = np.zeros(len(arrays), np.int64)
    end = 0
    for index, array in enumerate(arrays):
        if id(array) not in first:
            first[id(array)] = end
            unique.append(array.reshape(-1))
            end += array.size
        starts[index] = first[id(array)]
    if len(unique) == 1:  # a single large table is not worth a copy
        return unique[0].astype(dtype, copy=False), starts
    flat = np.concatenate(unique).astype(dtype, copy=False) if unique else np.zeros(0, dtype)
    return flat, starts


def _bounds(counts: Sequence[int]) -> NDArray[np.int64]:
    """Return (P + 1,) boundaries of consecutive runs."""
    return np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)


class StartMix(NamedTuple):
    """How starts are drawn, as a tuple for kernels. The other episodes begin in the yard.

    Attributes:
        anywhere: Share of episodes that begin at any placement from which the target can be reached.
        near_target: Share that begins at such a placement within ``reach`` cells of the target: the last moves are the
            hardest, and early in the training an episode from the yard seldom reaches them.
        reach: Half the edge of the cube about the target, cells.
    """

    anywhere: float
    near_target: float
    reach: int


YARD_ONLY = StartMix(0.0, 0.0, 0)
TRAINING_MIX = StartMix(0.3, 0.3, 10)

_TRIES = 64


@leaf_kernel
def random_unit(generator: NDArray[np.uint64]) -> float:
    """Return a uniform number in [0, 1) and advance the generator, (1,) uint64.

    SplitMix64 (Steele, Lea, Flood 2014): one word of state, so that kernels can carry it.
    """
    generator[0] += np.uint64(0x9E3779B97F4A7C15)
    z = generator[0]
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    z ^= z >> np.uint64(31)
    return float(np.float64(z >> np.uint64(11)) / 9007199254740992.0)


@leaf_kernel
def random_below(generator: NDArray[np.uint64], n: int) -> int:
    """Return a uniform integer in [0, n)."""
    return int(min(n - 1, int(random_unit(generator) * n)))


@leaf_kernel
def draw_start(pool: ProblemPool, p: int, mix: StartMix, generator: NDArray[np.uint64]) -> tuple[int, int, int]:
    """Return a reference cell at which an episode of problem ``p`` begins; the target can be reached from it."""
    draw = random_unit(generator)
    if draw < mix.anywhere + mix.near_target and pool.distances.size > 0:
        near = draw >= mix.anywhere
        nx, ny, nz = pool.table_shape[p, 0] - 1, pool.table_shape[p, 1] - 1, pool.table_shape[p, 2] - 1
        x0, y0, z0, x1, y1, z1 = 0, 0, 0, nx, ny, nz
        if near:
            tx, ty, tz = pool.target[p, 0], pool.target[p, 1], pool.target[p, 2]
            x0, y0, z0 = max(0, tx - mix.reach), max(0, ty - mix.reach), max(0, tz - mix.reach)
            x1, y1, z1 = min(nx, tx + mix.reach + 1), min(ny, ty + mix.reach + 1), min(nz, tz + mix.reach + 1)
        for _ in range(_TRIES):
            x = x0 + random_below(generator, x1 - x0)
            y = y0 + random_below(generator, y1 - y0)
            z = z0 + random_below(generator, z1 - z0)
            if pooled_distance(pool, p, x, y, z) > 0:
                return int(x), int(y), int(z)
    first, last = pool.starts_start[p], pool.starts_start[p + 1]
    s = first + random_below(generator, last - first)
    return int(pool.starts[s, 0]), int(pool.starts[s, 1]), int(pool.starts[s, 2])
