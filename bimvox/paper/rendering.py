"""The picture of the paper's construction site, with the ray caster."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.grid.frame import GridFrame
from bimvox.paper.env.picture import LOOK_RGB, Look, SitePicture
from bimvox.paper.env.spec import Box
from bimvox.rendering.colours import OBSTRUCTION, START_BOX, TARGET_BOX
from bimvox.rendering.pictures.picture import PictureOptions, picture_of
from bimvox.rendering.pictures.scene import LegendEntry, Scene, Strokes, Swatch, box_edges
from bimvox.site.component import Rgb

RENDER_SIZE_PX = (640, 480)

_FRAME = GridFrame((0.0, 0.0, 0.0), 1.0)
_GROW = 0.03


def paper_site_scene(picture: SitePicture) -> Scene:
    """Return the scene of a construction site: components in the colours of their states.

    Initial positions are orange line boxes, targets pink wireframes.
    """
    solids = np.zeros(picture.looks.shape, np.uint16)
    palette: list[Rgb] = [(0, 0, 0)]
    for look, rgb in LOOK_RGB.items():
        there = picture.looks == look
        # Each component is a solid of its own, so that an edge is drawn between neighbours.
        for part in np.unique(picture.parts[there]):
            solids[there & (picture.parts == part)] = len(palette)
            palette.append(OBSTRUCTION if look is Look.OBSTRUCTION else rgb)
    strokes = [
        Strokes(_edges(boxes), rgb, width_px=2.0, hidden_opacity=0.5)
        for boxes, rgb in ((picture.starts, START_BOX), (picture.targets, TARGET_BOX))
        if boxes
    ]
    nx, ny, nz = picture.looks.shape
    corners = np.array([[x, y, z] for x in (0, nx) for y in (0, ny) for z in (0, nz)], np.float64)
    return Scene(
        frame=_FRAME,
        solids=solids,
        palette=np.array(palette, np.uint8),
        strokes=tuple(strokes),
        legend=tuple(_legend(picture)),
        caption=picture.caption,
        points_m=corners,
    )


def paper_site_pixels(picture: SitePicture) -> NDArray[np.uint8]:
    """Return the picture of a construction site without text: (480, 640, 3) uint8 sRGB."""
    return picture_of(paper_site_scene(picture), PictureOptions(size_px=RENDER_SIZE_PX, annotated=False))


def _legend(picture: SitePicture) -> list[LegendEntry]:
    there = [look for look in LOOK_RGB if (picture.looks == look).any()]
    entries = [
        LegendEntry(look.name.lower().replace("_", " "), OBSTRUCTION if look is Look.OBSTRUCTION else LOOK_RGB[look])
        for look in there
    ]
    if picture.starts:
        entries.append(LegendEntry("initial position", START_BOX, Swatch.BOX))
    if picture.targets:
        entries.append(LegendEntry("target", TARGET_BOX, Swatch.BOX))
    return entries


def _edges(boxes: tuple[Box, ...]) -> NDArray[np.float64]:
    return np.concatenate([box_edges(np.array(low) - _GROW, np.array(high) + _GROW) for low, high in boxes])
