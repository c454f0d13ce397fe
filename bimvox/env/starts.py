"""Where training episodes begin."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import leaf_kernel
from bimvox.env.pool import ProblemPool, pooled_distance


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
