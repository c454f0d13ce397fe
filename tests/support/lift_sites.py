"""Sites as occupancy only, for tests of the environment, the policy and its roll-outs."""

from __future__ import annotations

import numpy as np

from bimvox.env.problem import LiftProblem, training_problem
from bimvox.grid.summed_area import summed_area_table, top_of_columns
from bimvox.site.collision import NOTHING_CLEARED, CollisionSpace

Cell = tuple[int, int, int]


def clearance_of(occupied: np.ndarray, size: Cell = (1, 1, 1), *, rope: bool = False) -> CollisionSpace:
    """Return the rule for a box of ``size`` hung by its middle among occupied cells, with or without a rope."""
    floor = top_of_columns(occupied) if rope else np.zeros(occupied.shape[:2], np.int32)
    return CollisionSpace(
        summed_area_table(occupied),
        np.array([[0, 0, 0, *size]], np.int32),
        np.array([size[0] // 2, size[1] // 2, size[2]], np.int32),
        floor,
        *NOTHING_CLEARED,
    )


def random_occupancy(seed: int, shape: Cell = (9, 8, 6), share: float = 0.2) -> np.ndarray:
    return np.random.default_rng(seed).random(shape) < share


def building_problems(
    seed: int = 0,
    *,
    count: int = 16,
    floors: int = 3,
    rope: bool = True,
    starts: int = 8,
    shape: Cell = (180, 80, 64),
) -> list[LiftProblem]:
    """Return lifts at stages of a frame that grows in the middle of the site: columns, beams on them, slabs.

    Column 2 x 2 x 12, beam 24 x 1 x 2, slab strip 24 x 5 x 1 cells, a storey of 15 cells;
    the yard next to it has stored parts.
    """
    random = np.random.default_rng(seed)
    parts: list[tuple[Cell, Cell]] = []
    for z in range(1, 1 + 15 * floors, 15):
        parts += [((100 + 24 * i, 20 + 20 * j, z), (2, 2, 12)) for i in range(3) for j in range(3)]
        parts += [((100 + 24 * i, 20 + 20 * j, z + 12), (24, 1, 2)) for i in range(2) for j in range(3)]
        parts += [((100 + 24 * i, 20 + 5 * j, z + 14), (24, 5, 1)) for i in range(2) for j in range(8)]
    occupied = np.zeros(shape, np.bool_)
    occupied[:, :, 0] = True
    for _ in range(25):
        x, y = random.integers(5, 70), random.integers(2, 70)
        dx, dy, dz = random.integers(3, 20), random.integers(1, 6), random.integers(1, 5)
        occupied[x : x + dx, y : y + dy, 1 : 1 + dz] = True
    chosen = set(np.linspace(0, len(parts) - 1, count).round().astype(int).tolist())
    problems = []
    for index, ((x, y, z), size) in enumerate(parts):
        if index in chosen:
            cells = np.stack(
                [random.integers(3, 70, 20 * starts), random.integers(2, 70, 20 * starts), np.full(20 * starts, 2)], 1
            )
            space = clearance_of(occupied, size, rope=rope)
            everywhere = training_problem(space, tuple(cells[0].tolist()), (x, y, z), cells)
            some = random.permutation(everywhere.starts_vox)[:starts]
            problems.append(
                LiftProblem(everywhere.space, tuple(some[0].tolist()), (x, y, z), some, everywhere.distance)
            )
        dx, dy, dz = size
        occupied[x : x + dx, y : y + dy, z : z + dz] = True
    return problems
