"""The content of a picture, as a value."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bimvox.grid.frame import GridFrame
from bimvox.site.construction import Rgb


@dataclass(frozen=True, slots=True, eq=False)
class Strokes:
    """Line segments that are drawn together, so that opacity does not add up where they cross.

    Attributes:
        segments_m: (N, 2, 3) float64 ends of each segment, metres.
        rgb: Colour.
        width_px: Minimum width, in pixels of a picture 800 pixels high.
        width_m: Width in metres, if that is wider.
        opacity: Opacity of visible segments, 0..1.
        hidden_opacity: Opacity of hidden segments, drawn dotted; 0 leaves them out.
        edge: Colour of a rim on both sides, or None.
        layer: Its ``Layer``; empty if it is always drawn.
    """

    segments_m: NDArray[np.float64]
    rgb: Rgb
    width_px: float = 2.0
    width_m: float = 0.0
    opacity: float = 1.0
    hidden_opacity: float = 0.0
    edge: Rgb | None = None
    layer: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """A rotated solid box, for machinery off the grid.

    Attributes:
        centre_m: (3,) float64.
        half_m: (3, 3) float64, rows are the half edges as vectors.
        rgb: Colour.
    """

    centre_m: NDArray[np.float64]
    half_m: NDArray[np.float64]
    rgb: Rgb


class Swatch(StrEnum):
    """The symbol of a legend entry."""

    FILL = "fill"
    LINE = "line"
    BOX = "box"


@dataclass(frozen=True, slots=True)
class LegendEntry:
    """One entry of the legend."""

    label: str
    rgb: Rgb
    swatch: Swatch = Swatch.FILL
    layer: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """The content of a picture.

    Attributes:
        frame: Metres to cells of ``solids``.
        solids: (X, Y, Z) unsigned integers: the solid that fills the cell, 0 for none. Edges are drawn between
            different solids, whatever their colours.
        palette: (N, 3) uint8 sRGB colour of each solid; row 0 is unused.
        strokes: Lines, drawn in this order.
        blocks: Rotated boxes.
        legend: What the colours mean.
        title: Upper left, large.
        caption: Below the title.
        points_m: (M, 3) float64 points that must be visible, in addition to the solids.
        layers: The ``Layer`` of each solid or an empty string, one per row of the palette; empty for none.
        focus_m: (2, 3) float64 lower and upper corner of the box that fills the picture; None shows everything.
    """

    frame: GridFrame
    solids: NDArray[np.unsignedinteger]
    palette: NDArray[np.uint8]
    strokes: tuple[Strokes, ...] = ()
    blocks: tuple[Block, ...] = ()
    legend: tuple[LegendEntry, ...] = ()
    title: str = ""
    caption: str = ""
    points_m: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 3)))
    layers: tuple[str, ...] = ()
    focus_m: NDArray[np.float64] | None = None


def polyline(points_m: ArrayLike) -> NDArray[np.float64]:
    """Return the (N - 1, 2, 3) segments of a line through (N, 3) points, without points on a straight run."""
    points = np.asarray(points_m, np.float64)
    if len(points) > 2:
        steps = np.diff(points, axis=0)
        turns = np.linalg.norm(np.cross(steps[:-1], steps[1:]), axis=1) > 1e-9 * np.linalg.norm(steps[:-1], axis=1)
        back = np.einsum("ij,ij->i", steps[:-1], steps[1:]) < 0.0
        points = points[np.r_[True, turns | back, True]]
    return np.stack([points[:-1], points[1:]], axis=1)


def box_edges(low_m: ArrayLike, high_m: ArrayLike) -> NDArray[np.float64]:
    """Return the (12, 2, 3) edges of an upright box."""
    ends = np.stack([np.asarray(low_m, np.float64), np.asarray(high_m, np.float64)])
    edges = []
    for axis in range(3):
        for a in (0, 1):
            for b in (0, 1):
                corner = np.insert(np.array([a, b]), axis, 0)
                start = ends[corner, [0, 1, 2]]
                end = start.copy()
                end[axis] = ends[1, axis]
                edges.append((start, end))
    return np.array(edges)
