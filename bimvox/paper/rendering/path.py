"""Planned paths on the paper's construction site, like Figure 4 of Zhu, Pauwels and de Vries (2021)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bimvox.paper.env.picture import SitePicture
from bimvox.paper.rendering.picture import paper_site_scene
from bimvox.rendering.colours import FAINT_INK, PAPER, PATH
from bimvox.rendering.pictures.picture import PictureOptions, picture_of
from bimvox.rendering.pictures.scene import LegendEntry, Scene, Strokes, Swatch, polyline

_CENTRE = 0.5
_LIFT = 0.06
"""The path before is drawn a little higher than the path after, so that both are visible where they agree."""


def scene_of_paths(
    picture: SitePicture,
    *,
    before_vox: Sequence[tuple[int, int, int]],
    after_vox: Sequence[tuple[int, int, int]],
    title: str,
    caption: str,
) -> Scene:
    """Return the scene of a site with the planned path and the final path.

    Args:
        picture: The site before the first move.
        before_vox: Reference cells of the path of the basic policy.
        after_vox: Reference cells of the path of the policy after the change; empty if there is none.
        title: Upper left.
        caption: Below the title.
    """
    scene = paper_site_scene(picture)
    strokes = list(scene.strokes)
    legend = list(scene.legend)
    if len(before_vox) > 1:
        points = np.array(before_vox, np.float64) + np.array([_CENTRE, _CENTRE, _CENTRE + _LIFT])
        strokes.append(Strokes(polyline(points), FAINT_INK, width_px=2.0, hidden_opacity=0.5, edge=PAPER))
        legend.append(LegendEntry("path before", FAINT_INK, Swatch.LINE))
    if len(after_vox) > 1:
        points = np.array(after_vox, np.float64) + _CENTRE
        strokes.append(Strokes(polyline(points), PATH, width_px=4.0, hidden_opacity=0.6, edge=PAPER))
        legend.append(LegendEntry("path after", PATH, Swatch.LINE))
    return replace(scene, strokes=tuple(strokes), legend=tuple(legend), title=title, caption=caption)


def draw_sheet(
    scenes: Sequence[Scene], *, columns: int = 2, size_px: tuple[int, int] = (640, 480)
) -> NDArray[np.uint8]:
    """Return pictures in rows, (height, width, 3) uint8 sRGB; the last row is filled with background."""
    pictures = [picture_of(scene, PictureOptions(size_px=size_px)) for scene in scenes]
    blank = np.broadcast_to(np.array(PAPER, np.uint8), (size_px[1], size_px[0], 3))
    pictures += [blank] * (-len(pictures) % columns)
    rows = [np.concatenate(pictures[n : n + columns], axis=1) for n in range(0, len(pictures), columns)]
    return np.concatenate(rows, axis=0)
