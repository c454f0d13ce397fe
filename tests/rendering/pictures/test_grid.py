from __future__ import annotations

import numpy as np
import pytest
from box_grids import grid_of, part

from bimvox.errors import InputError
from bimvox.grid.frame import GridFrame, Label
from bimvox.grid.voxel_grid import VoxelGrid
from bimvox.rendering.pictures.picture import PictureOptions, picture_of
from bimvox.rendering.pictures.site import scene_of_grid


def grid_of_boxes(boxes, *, ground: bool = False) -> VoxelGrid:
    """Return a grid of boxes: (class, label, low, high) in cells."""
    shares = np.zeros((len(boxes) + ground, 14, 12, 8))
    for share, (_, _, low, high) in zip(shares, boxes, strict=False):
        share[tuple(slice(a, b) for a, b in zip(low, high, strict=True))] = 1.0
    parts = [part(f"p{n}", ifc_class, label) for n, (ifc_class, label, _, _) in enumerate(boxes)]
    if ground:
        shares[-1, :, :, 0] = 0.5
        parts.append(part("ground", label=Label.GROUND))
    return grid_of(shares, parts, shape=(14, 12, 8), frame=GridFrame((0.0, 0.0, 0.0), 0.5))


BOXES = [
    ("IfcBeam", Label.COMPONENT, (1, 9, 0), (13, 11, 2)),
    ("IfcColumn", Label.COMPONENT, (2, 2, 0), (4, 4, 4)),
    ("IfcColumn", Label.COMPONENT, (10, 2, 0), (12, 4, 4)),
    ("IfcFooting", Label.STRUCTURE, (5, 5, 0), (9, 8, 1)),
]


def test_every_colour_of_the_legend_is_in_the_picture():
    scene = scene_of_grid(grid_of_boxes(BOXES), title="grid")
    picture = picture_of(scene, PictureOptions(size_px=(480, 320), annotated=False)).reshape(-1, 3).astype(int)
    assert [entry.label for entry in scene.legend] == ["IfcColumn (2)", "IfcBeam (1)", "not lifted (1)"]
    for entry in scene.legend:
        # Level faces in the sun have the exact colour, up to rounding and the share of the sky.
        assert (np.abs(picture - entry.rgb).max(axis=1) <= 6).any(), entry.label


def test_parts_of_a_class_share_a_colour_but_not_a_number():
    scene = scene_of_grid(grid_of_boxes(BOXES))
    numbers = np.unique(scene.solids)
    assert len(numbers) == 1 + 1 + 4  # nothing, floor, four parts
    colours = {tuple(row) for row in scene.palette[-3:-1].tolist()}
    assert len(colours) == 1


def test_a_floor_is_laid_only_where_there_is_no_ground():
    floor = scene_of_grid(grid_of_boxes(BOXES))
    assert (floor.solids[:, :, 0] == 1).all()
    assert floor.frame.origin_m[2] == -0.5
    assert floor.solids.shape[0] > 14
    ground = scene_of_grid(grid_of_boxes(BOXES[:1], ground=True))
    assert ground.solids.shape == (14, 12, 8)
    assert not (ground.solids == 1).any()


def test_the_floor_does_not_move_the_building():
    grid = grid_of_boxes(BOXES)
    scene = scene_of_grid(grid)
    beam = np.argwhere(grid.owners.dense() == 0).mean(axis=0)
    number = scene.solids[tuple((scene.frame.cell_of(grid.frame.centre_of(np.array([5, 10, 1])))).tolist())]
    drawn = np.argwhere(scene.solids == number).mean(axis=0)
    np.testing.assert_allclose(scene.frame.centre_of(drawn), grid.frame.centre_of(beam))


def test_an_empty_grid_is_an_error_that_says_so():
    with pytest.raises(InputError, match="nothing to draw"):
        picture_of(scene_of_grid(grid_of_boxes([])))
