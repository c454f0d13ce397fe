"""The outline of a site, kept with its policy: enough to measure how similar another site is."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.errors import PolicyError
from bimvox.grid.frame import Label
from bimvox.site.site import Site

BLOCKS = (8, 8, 4)
"""Blocks of the sketch along x, y and z, for any site."""


@dataclass(frozen=True, slots=True)
class SiteOutline:
    """A site in a few numbers, without its obstructions, which change.

    Attributes:
        shape_vox: (X, Y, Z) cells of the grid.
        voxel_size_m: Edge of a cell.
        components: Number of lifted parts.
        longest_vox: Longest edge of their bounding boxes.
        rope: Whether the rope above a load must be free.
        sketch: Share of every block filled by the finished building and the structure, 0 to 255, as hexadecimal digits
            (x slowest, z fastest).
    """

    shape_vox: tuple[int, int, int]
    voxel_size_m: float
    components: int
    longest_vox: int
    rope: bool
    sketch: str

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        return {**asdict(self), "shape_vox": list(self.shape_vox)}


def outline_of(site: Site) -> SiteOutline:
    """Return the outline of a site."""
    filled = site.labels == Label.STRUCTURE
    for component in site.components:
        cells = component.shape.cells + np.array(component.target_vox)
        filled[tuple(cells.T)] = True
    return SiteOutline(
        site.shape,
        site.frame.voxel_size_m,
        len(site.components),
        max(max(component.shape.size_vox) for component in site.components),
        bool(site.cranes) and site.rules.rope,
        _sketch(filled).tobytes().hex(),
    )


def outline_from_dict(plain: Mapping[str, Any]) -> SiteOutline:
    """Return the outline of :meth:`SiteOutline.to_dict`.

    Raises:
        PolicyError: A key is missing or unknown, or a value is impossible.
    """
    try:
        x, y, z = (int(n) for n in plain["shape_vox"])
        outline = SiteOutline(**{**plain, "shape_vox": (x, y, z)})
        sketch = bytes.fromhex(outline.sketch)
        possible = min(x, y, z, outline.components, outline.longest_vox) > 0 and outline.voxel_size_m > 0
    except (KeyError, TypeError, ValueError) as error:
        raise PolicyError(f"the outline of the policy's site cannot be read: {error}") from error
    if len(sketch) != math.prod(BLOCKS) or not possible:
        raise PolicyError("the outline of the policy's site holds impossible values")
    return outline


def distance(a: SiteOutline, b: SiteOutline) -> float:
    """Return the distance of two sites: 0 for equal outlines, about 1 for sites with little in common.

    It is the sum of: the mean difference of the sketches (0 to 1); the mean logarithmic ratio (base 2) of the grids'
    edges; that of the cells; a quarter of those of the number of parts and of the longest part; 1 if only one has a
    rope rule. It is a metric, because each term is one.
    """
    edges = np.mean([abs(math.log2(p / q)) for p, q in zip(a.shape_vox, b.shape_vox, strict=True)])
    cell = abs(math.log2(a.voxel_size_m / b.voxel_size_m))
    parts = abs(math.log2(a.components / b.components)) + abs(math.log2(a.longest_vox / b.longest_vox))
    sketches = np.mean(np.abs(_shares(a) - _shares(b)))
    return float(sketches + edges + cell + 0.25 * parts + (a.rope != b.rope))


def _shares(outline: SiteOutline) -> NDArray[np.float64]:
    return np.frombuffer(bytes.fromhex(outline.sketch), np.uint8) / 255.0


def _sketch(filled: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """Return (8, 8, 4) uint8 shares; sites smaller than the blocks repeat cells."""
    table = np.zeros(np.array(filled.shape) + 1, np.int64)
    table[1:, 1:, 1:] = filled.cumsum(0).cumsum(1).cumsum(2)
    bounds = []
    for size, blocks in zip(filled.shape, BLOCKS, strict=True):
        low = np.arange(blocks) * size // blocks
        high = np.maximum(low + 1, (np.arange(blocks) + 1) * size // blocks)
        bounds.append((low, high))
    sums = np.zeros(BLOCKS, np.int64)
    for corner in range(8):
        ends = [bound[(corner >> axis) & 1] for axis, bound in enumerate(bounds)]
        sums += (-1) ** (3 - corner.bit_count()) * table[np.ix_(*ends)]
    volumes = np.prod(np.meshgrid(*[high - low for low, high in bounds], indexing="ij"), axis=0)
    shares: NDArray[np.uint8] = np.round(255.0 * sums / volumes).astype(np.uint8)
    return shares
