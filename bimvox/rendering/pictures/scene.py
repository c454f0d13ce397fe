"""The content of a picture, as a value."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bimvox.errors import SelectionError
from bimvox.grid.frame import GridFrame
from bimvox.site.component import Rgb


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


# Layers of a scene, which can be hidden.


class Layer(StrEnum):
    """A layer that a picture can leave out."""

    GROUND = "ground"
    """Ground and areas."""
    STRUCTURE = "structure"
    OBSTRUCTIONS = "obstructions"
    UNBUILT = "unbuilt"
    ASSEMBLED = "assembled"
    CRANE = "crane"
    PATHS = "paths"
    BOXES = "boxes"
    """Start and target boxes."""
    WORDS = "words"
    """Title, caption and legend."""


def without(scene: Scene, hidden: Collection[Layer]) -> Scene:
    """Return a scene without the solids, lines and legend entries of some layers; the camera stays the same.

    The picture's options handle ``WORDS``.
    """
    if not hidden:
        return scene
    drawn = np.array([layer not in hidden for layer in scene.layers] or [True] * len(scene.palette), np.bool_)
    numbers = np.arange(len(drawn)).astype(scene.solids.dtype)
    numbers[~drawn] = 0
    return replace(
        scene,
        solids=numbers[scene.solids],
        strokes=tuple(strokes for strokes in scene.strokes if strokes.layer not in hidden),
        blocks=() if Layer.CRANE in hidden else scene.blocks,
        legend=tuple(entry for entry in scene.legend if entry.layer not in hidden),
        points_m=np.zeros((0, 3)) if Layer.CRANE in hidden else scene.points_m,
    )


def layers_named(names: Collection[str]) -> frozenset[Layer]:
    """Return the layers of these names.

    Raises:
        SelectionError: If there is no such layer.
    """
    known = {layer.value: layer for layer in Layer}
    for name in names:
        if name not in known:
            raise SelectionError(f"there is no layer {name!r}", hint=f"layers are {', '.join(known)}")
    return frozenset(known[name] for name in names)


# Paints solids: a volume of indices and the colour of each index.


def index_type(count: int) -> type[np.unsignedinteger]:
    """Return the smallest unsigned type for this many solids, including 0."""
    return np.uint16 if count <= 1 << 16 else np.uint32


class Canvas:
    """A volume of (X, Y, Z) cells that is painted solid by solid, ``count`` of them at most."""

    def __init__(self, shape: tuple[int, int, int], count: int) -> None:
        self.solids: NDArray[np.unsignedinteger] = np.zeros(shape, index_type(count + 1))
        self._rgb: list[Rgb] = [(0, 0, 0)]
        self._layers: list[str] = [""]

    def paint(self, cells: NDArray[np.integer], rgb: Rgb, *, over: bool = False, layer: str = "") -> int:
        """Paint a solid and return its number.

        Args:
            cells: (N, 3); those outside the volume are ignored.
            rgb: Its colour.
            over: Whether it overwrites other solids.
            layer: Its ``Layer``; empty if it is always drawn.
        """
        inside = ((cells >= 0) & (cells < self.solids.shape)).all(axis=1)
        at = tuple(cells[inside].T)
        number = self._next(rgb, layer)
        if over:
            self.solids[at] = number
        else:
            self.solids[at] = np.where(self.solids[at] == 0, number, self.solids[at])
        return number

    def paint_columns(self, mask: NDArray[np.bool_], layers: NDArray[np.int32], rgb: Rgb, *, layer: str = "") -> None:
        """Paint one cell of each (X, Y) column of a mask, in its layer of ``layers`` (X, Y)."""
        x, y = np.nonzero(mask)
        self.solids[x, y, layers[mask]] = self._next(rgb, layer)

    def copy(self, more: int = 0) -> Canvas:
        """Return a separate canvas with the same solids and room for more."""
        other = Canvas.__new__(Canvas)
        other.solids, other._rgb, other._layers = self.solids.copy(), list(self._rgb), list(self._layers)
        if len(other._rgb) + more > np.iinfo(other.solids.dtype).max:
            other.solids = other.solids.astype(np.uint32)
        return other

    def _next(self, rgb: Rgb, layer: str) -> int:
        self._rgb.append(rgb)
        self._layers.append(str(layer))
        return len(self._rgb) - 1

    @property
    def layers(self) -> tuple[str, ...]:
        """The layer of each solid."""
        return tuple(self._layers)

    @property
    def palette(self) -> NDArray[np.uint8]:
        """(N, 3) uint8 colours of the painted solids."""
        return np.array(self._rgb, np.uint8)
