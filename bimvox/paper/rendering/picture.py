"""The picture of the paper's construction site, with the ray caster."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.grid.frame import GridFrame
from bimvox.paper.env.component import Box
from bimvox.paper.env.picture import LOOK_RGB, Look, SitePicture
from bimvox.rendering.colours import OBSTRUCTION, START_BOX, TARGET_BOX
from bimvox.rendering.draw.picture import PictureOptions, picture_of
from bimvox.rendering.scene.scene import LegendEntry, Scene, Strokes, Swatch, box_edges
from bimvox.site.construction import Rgb

_FRAME = GridFrame((0.0, 0.0, 0.0), 1.0)
_GROW = 0.03
_AIR_RGB: Rgb = (255, 255, 255)
_NAMES: dict[Look, str] = {
    Look.GROUND: "ground",
    Look.CONSTRUCTION_AREA: "construction area",
    Look.OBSTRUCTION: "obstruction",
    Look.UNBUILT: "unbuilt",
    Look.IN_TRANSIT: "in transit",
    Look.ARRIVED: "arrived",
    Look.ASSEMBLED: "assembled",
}
_AREAS = (Look.GROUND, Look.CONSTRUCTION_AREA)


def paper_site_scene(picture: SitePicture, *, air: bool = False, title: str = "", legend: bool = True) -> Scene:
    """Return the scene of a construction site: components in the colours of their states.

    Initial positions are orange line boxes, targets pink wireframes.

    Args:
        picture: What to show.
        air: Whether the cells of air are drawn as a white wireframe.
        title: Upper left; the picture's caption is below it.
        legend: Whether the colours are explained.
    """
    solids = np.zeros(picture.looks.shape, np.uint16)
    palette: list[Rgb] = [(0, 0, 0)]
    for look, rgb in LOOK_RGB.items():
        there = picture.looks == look
        # Each component is a solid of its own, so that an edge is drawn between neighbours.
        for part in np.unique(picture.parts[there]):
            solids[there & (picture.parts == part)] = len(palette)
            palette.append(OBSTRUCTION if look is Look.OBSTRUCTION else rgb)
    strokes = [*([_air(picture)] if air else [])]
    strokes += [Strokes(_edges(picture.starts), START_BOX, width_px=2.0, hidden_opacity=0.5)]
    strokes += [Strokes(_edges(picture.targets), TARGET_BOX, width_px=2.0, hidden_opacity=0.5)]
    nx, ny, nz = picture.looks.shape
    corners = np.array([[x, y, z] for x in (0, nx) for y in (0, ny) for z in (0, nz)], np.float64)
    return Scene(
        frame=_FRAME,
        solids=solids,
        palette=np.array(palette, np.uint8),
        strokes=tuple(s for s in strokes if len(s.segments_m)),
        legend=tuple(_legend(picture)) if legend else (),
        title=title,
        caption=picture.caption,
        points_m=corners,
    )


def paper_site_pixels(picture: SitePicture, size_px: tuple[int, int] = (640, 480)) -> NDArray[np.uint8]:
    """Return the picture of a construction site without text: (height, width, 3) uint8 sRGB."""
    return picture_of(paper_site_scene(picture), PictureOptions(size_px=size_px, annotated=False))


def _legend(picture: SitePicture) -> list[LegendEntry]:
    there = [look for look in LOOK_RGB if (picture.looks == look).any()]
    entries = [LegendEntry(_NAMES[look], OBSTRUCTION if look is Look.OBSTRUCTION else LOOK_RGB[look]) for look in there]
    if picture.starts:
        entries.append(LegendEntry("initial position", START_BOX, Swatch.BOX))
    if picture.targets:
        entries.append(LegendEntry("target", TARGET_BOX, Swatch.BOX))
    return entries


def _edges(boxes: tuple[Box, ...]) -> NDArray[np.float64]:
    edges = [box_edges(np.array(low) - _GROW, np.array(high) + _GROW) for low, high in boxes]
    return np.concatenate(edges) if edges else np.zeros((0, 2, 3))


def _air(picture: SitePicture) -> Strokes:
    """Return the lattice of the cells above the slab."""
    nx, ny, nz = picture.looks.shape
    segments = [((x, y, 1), (x, y, nz)) for x in range(nx + 1) for y in range(ny + 1)]
    segments += [((x, 0, z), (x, ny, z)) for x in range(nx + 1) for z in range(1, nz + 1)]
    segments += [((0, y, z), (nx, y, z)) for y in range(ny + 1) for z in range(1, nz + 1)]
    return Strokes(np.array(segments, np.float64), _AIR_RGB, width_px=1.0, opacity=0.6)
