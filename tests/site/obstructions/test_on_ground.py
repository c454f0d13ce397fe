"""What is no higher than the ground is not in the way of what lies and stands on it, whatever the clearance."""

from __future__ import annotations

import numpy as np
import pytest
from box_buildings import rasterise_boxes
from box_sites import box_mesh

from bimvox.grid.frame import GridFrame
from bimvox.site.obstructions.cells import Where, obstruction_cells
from bimvox.site.obstructions.obstruction_set import Box, Cylinder, Obstruction, Points, Voxels

FRAME = GridFrame((0.0, 0.0, -0.2), 0.2)
SHAPE = (20, 20, 10)
FLAT = np.zeros(SHAPE[:2], np.int32)
PLATES = {
    "survey of bare ground": box_mesh((0, 0, -1), (4, 4, 0)),
    "survey below the ground": box_mesh((0, 0, -1), (4, 4, -0.1)),
    "plate": Box((1, 1, -0.1), (2, 2, 0)),
    "manhole": Cylinder((2, 2, -0.15), 0.5, 0.15),
    "cells": Voxels(((3, 3, 0), (4, 3, 0))),
    "scan": Points(np.array([[x, y, 0.0] for x in np.arange(0.1, 4.0, 0.5) for y in np.arange(0.1, 4.0, 0.5)])),
}


def cells(form, ground_vox, grow_vox=3):
    return obstruction_cells(
        Obstruction("x", form), FRAME, SHAPE, rasterise_boxes, grow_vox=grow_vox, ground_vox=ground_vox
    )


@pytest.mark.parametrize("name", sorted(PLATES))
@pytest.mark.parametrize("grow_vox", [0, 3])
def test_nothing_above_the_ground_is_taken(name, grow_vox):
    found, where = cells(PLATES[name], FLAT, grow_vox)
    assert not (found[:, 2] > 0).any()
    assert where is not Where.OUTSIDE


def test_what_rises_above_the_ground_keeps_its_clearance_also_in_a_survey():
    hump = box_mesh((2, 2, -1), (2.2, 2.2, 0.4))
    found, _ = cells(hump, FLAT)
    assert found[found[:, 2] > 0].max(axis=0).tolist() == [13, 13, 5]
    assert found[found[:, 2] > 0].min(axis=0).tolist() == [7, 7, 1]


def test_in_an_excavation_what_lies_deeper_than_the_ground_around_is_in_the_way():
    raised = np.where(np.arange(20)[:, None] < 10, 3, 0).astype(np.int32) * np.ones((1, 20), np.int32)
    pipe = Box((1, 1, 0), (3, 1.2, 0.4))
    found, _ = cells(pipe, raised, grow_vox=1)
    assert found[:, 0].min() == 9, "it lies in the ground up to x = 2 m, and its clearance reaches one cell into that"
    assert found[:, 0].max() == 15
    scan = Points(np.array([[0.1, 0.1, 0.6], [3.1, 0.1, 0.0], [3.5, 0.1, 0.05]]))
    found, _ = cells(scan, raised, grow_vox=0)
    assert [(x, z) for x, _, z in found.tolist()] == [(0, 3), (15, 0), (17, 1)]
