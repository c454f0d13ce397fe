"""Grids whose tables agree with their cells, for tests without a model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.grid.bricks import Bricks
from bimvox.grid.frame import GridFrame, Label
from bimvox.grid.summed_area import boxes_of
from bimvox.grid.voxel_grid import Part, VoxelGrid

UNIT_FRAME = GridFrame((0.0, 0.0, 0.0), 1.0)


def part(name: str, ifc_class: str = "Mesh", label: Label = Label.COMPONENT, **more: Any) -> Part:
    return Part(name, name, ifc_class, name, "component", label, 0, 1.0, 2400.0, "density", "winding", **more)


def grid_of(
    shares: Sequence[NDArray[np.floating]],
    parts: Sequence[Part] | None = None,
    *,
    frame: GridFrame = UNIT_FRAME,
    shape: tuple[int, int, int] | None = None,
    **more: Any,
) -> VoxelGrid:
    """Return a grid of parts, given the shares of its cells that they fill: (X, Y, Z) each, above 0 in met cells."""
    shape = shape or shares[0].shape
    stack = np.array(shares, np.float32).reshape(-1, *shape)
    met = stack > 0
    parts = parts or [part(f"p{n}") for n in range(len(stack))]
    owners = np.full(shape, -1, np.int32)
    if len(stack):
        owners = np.where(met.any(axis=0), stack.argmax(axis=0), -1).astype(np.int32)
    shared = (met.sum(axis=0) > 1) & met
    rows = np.argwhere(np.moveaxis(shared, 0, -1)).astype(np.int32)
    boxes = [boxes_of(cells) for cells in met]
    return VoxelGrid(
        frame=frame,
        owners=Bricks.of(owners),
        parts=tuple(replace(one, cells=int(cells.sum())) for one, cells in zip(parts, met, strict=True)),
        shared_cells=rows[:, :3].copy(),
        shared_parts=rows[:, 3].copy(),
        shared_fractions=stack[rows[:, 3], rows[:, 0], rows[:, 1], rows[:, 2]],
        boxes=np.concatenate([np.empty((0, 6), np.int32), *boxes]),
        box_parts=np.repeat(np.arange(len(boxes), dtype=np.int32), [len(some) for some in boxes]),
        **more,
    )


def random_shares(seed: int, shape: tuple[int, int, int], parts: int) -> list[NDArray[np.float32]]:
    """Return parts that fill random, overlapping boxes by random shares."""
    rng = np.random.default_rng(seed)
    shares = np.zeros((parts, *shape), np.float32)
    for share in shares:
        a, b = np.sort(rng.integers(0, np.array(shape) + 1, (2, 3)), axis=0)
        box = tuple(
            slice(low, max(high, low + 1)) for low, high in zip(np.minimum(a, np.array(shape) - 1), b, strict=True)
        )
        share[box] = (rng.random(share[box].shape) < 0.7) * rng.uniform(0.01, 1.0, share[box].shape)
    return list(shares)
