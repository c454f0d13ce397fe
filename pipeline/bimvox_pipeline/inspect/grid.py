"""The content of a grid, as plain values: the table of its parts, their sums, and one part in full."""

from __future__ import annotations

import difflib
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from bimvox.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from bimvox.grid.voxel_grid import VoxelGrid

_STATED = (
    *("id", "global_id", "ifc_class", "type_name", "name", "role", "storey", "material"),
    *("mass_kg", "mass_source", "cells", "solid_volume_m3"),
)
_SUMMED = ("cells", "solid_volume_m3", "mass_kg", "boxes")


def describe_grid(grid: VoxelGrid) -> dict[str, Any]:
    """Return extent, frame, source, counts, parts and sums of a grid."""
    parts = describe_parts(grid)
    return {
        "shape": list(grid.shape),
        "cells": math.prod(grid.shape),
        "voxel_size_m": grid.frame.voxel_size_m,
        "origin_m": list(grid.frame.origin_m),
        "source": dict(grid.source),
        "source_origin_m": list(grid.origin_m),
        "georeference": dict(grid.georeference),
        "counts": grid.counts(),
        "shared_cells": len(np.unique(grid.shared_cells, axis=0)),
        "parts": parts,
        "totals": describe_totals(parts),
    }


def describe_parts(grid: VoxelGrid) -> list[dict[str, Any]]:
    """Return every part of a grid, in its order.

    ``fill_fraction`` is the share of the part's cells that its solid fills, ``fill`` how its interior was found,
    ``boxes`` the number of its boxes, ``shared_cells`` how many of its cells other parts also meet.
    """
    boxes = np.bincount(grid.box_parts, minlength=len(grid.parts)).tolist()
    shared = np.bincount(grid.shared_parts, minlength=len(grid.parts)).tolist()
    return [
        {
            **{key: getattr(part, key) for key in _STATED},
            "fill_fraction": grid.fill_fraction(part),
            "fill": part.fill,
            "boxes": boxes[index],
            "shared_cells": shared[index],
        }
        for index, part in enumerate(grid.parts)
    ]


def describe_totals(parts: Sequence[Mapping[str, Any]]) -> dict[str, dict[str, Any]]:
    """Return sums over parts by role, and over ``all``; a cell that several parts meet counts for each of them."""
    roles = dict.fromkeys(str(part["role"]) for part in parts)
    chosen = {role: [part for part in parts if part["role"] == role] for role in roles} | {"all": list(parts)}
    return {
        role: {"parts": len(members)} | {key: sum(part[key] for part in members) for key in _SUMMED}
        for role, members in chosen.items()
    }


def describe_part(grid: VoxelGrid, wanted: str) -> dict[str, Any]:
    """Return one part with its boxes and the parts that it shares cells with.

    Args:
        grid: The grid.
        wanted: The part's id, or a GlobalId or name that only one part has.

    Returns:
        The row of :func:`describe_parts`, ``bounds_m`` in the grid's metres, ``box_cells`` (half-open
        ``x0 y0 z0 x1 y1 z1``) and ``shares_cells_with``.

    Raises:
        InputError: If no part, or several, have that id or name.
    """
    index = _index_of(grid, wanted)
    boxes = grid.boxes[grid.box_parts == index]
    low, high = boxes[:, :3].min(axis=0), boxes[:, 3:].max(axis=0)
    size, origin = grid.frame.voxel_size_m, np.array(grid.frame.origin_m)
    _, cell = np.unique(grid.shared_cells, axis=0, return_inverse=True)
    cell = cell.reshape(-1)
    sharing = np.isin(cell, cell[grid.shared_parts == index]) & (grid.shared_parts != index)
    others, counts = np.unique(grid.shared_parts[sharing], return_counts=True)
    return describe_parts(grid)[index] | {
        "bounds_m": [(origin + corner * size).round(6).tolist() for corner in (low, high)],
        "box_cells": boxes.tolist(),
        "shares_cells_with": [
            {"id": grid.parts[other].id, "name": grid.parts[other].name, "cells": int(count)}
            for other, count in zip(others.tolist(), counts, strict=True)
        ],
    }


def _index_of(grid: VoxelGrid, wanted: str) -> int:
    for key in ("id", "global_id", "name"):
        found = [index for index, part in enumerate(grid.parts) if getattr(part, key) == wanted]
        if len(found) == 1:
            return found[0]
        if found:
            ids = ", ".join(grid.parts[index].id for index in found[:5])
            raise InputError(f"{len(found)} parts have the {key} {wanted!r}", hint=f"give an id: {ids}")
    known = list(dict.fromkeys(text for part in grid.parts for text in (part.id, part.name) if text))
    close = difflib.get_close_matches(wanted, known, n=3)
    raise InputError(
        f"no part of the grid has the id or name {wanted!r}",
        hint=f"did you mean {' or '.join(close)}?" if close else "`bimvox inspect GRID --json` lists all parts",
    )
