from __future__ import annotations

import numpy as np

from bimvox.grid.frame import GridFrame
from bimvox.rendering.pictures.camera import View
from bimvox.rendering.pictures.picture import PictureOptions, camera_of, draw_blocks
from bimvox.rendering.pictures.raycast import cast, light_for
from bimvox.rendering.pictures.scene import Block, Scene

FRAME = GridFrame((0.0, 0.0, 0.0), 1.0)
VIEW = View(-70.0, 25.0)


def buffers_of(solids: np.ndarray, blocks: tuple[Block, ...]):
    everything = np.ones((12, 12, 8), np.uint16)
    scene = Scene(FRAME, everything, np.zeros((2, 3), np.uint8))
    camera = camera_of(scene, PictureOptions(size_px=(160, 120), view=VIEW, annotated=False))
    light = light_for(VIEW)
    buffers = cast(solids, FRAME, camera, light, 1, lines=0.0)
    draw_blocks(buffers, blocks, camera, light, 1)
    return buffers


def test_a_block_on_the_grid_looks_like_the_cells_it_covers():
    cells = np.zeros((12, 12, 8), np.uint16)
    cells[3:7, 2:5, 1:4] = 1
    block = Block(np.array([5.0, 3.5, 2.5]), np.diag([2.0, 1.5, 1.5]), (9, 9, 9))
    as_cells, as_block = buffers_of(cells, ()), buffers_of(np.zeros_like(cells), (block,))
    same = as_cells.solid == as_block.solid
    assert same.mean() > 0.999
    there = (as_cells.solid == 1) & (as_block.solid == 1)
    assert there.sum() > 500
    np.testing.assert_allclose(as_cells.depth_m[there], as_block.depth_m[there], rtol=1e-4)


def test_blocks_and_cells_hide_each_other_by_depth():
    wall = np.zeros((12, 12, 8), np.uint16)
    wall[:, 5:7, :] = 7
    before = Block(np.array([6.0, 2.0, 4.0]), np.eye(3), (9, 9, 9))
    behind = Block(np.array([6.0, 10.0, 4.0]), np.eye(3), (9, 9, 9))
    assert (buffers_of(wall, (before,)).solid == 1).any()
    assert not (buffers_of(wall, (behind,)).solid == 1).any()
