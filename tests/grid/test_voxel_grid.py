from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from box_grids import grid_of, part

from bimvox.grid.labels import Label


def test_counts_cover_every_cell_air_included() -> None:
    beam, ground = np.zeros((2, 2, 3, 4))
    beam[0, 0] = 1.0
    ground[1, 0, 0] = 1.0
    grid = grid_of([beam, ground], [part("beam"), part("ground", label=Label.GROUND)])
    assert grid.shape == (2, 3, 4)
    assert grid.counts() == {"air": 19, "ground": 1, "component": 4}
    assert grid_of([], shape=(3, 3, 3)).counts() == {"air": 27}


def test_labels_follow_from_owners() -> None:
    grid = grid_of([np.ones((1, 1, 2))], [part("wall", label=Label.STRUCTURE)])
    assert grid.label_table.tolist() == [Label.AIR, Label.STRUCTURE]


def test_the_fill_fraction_is_the_solid_in_the_cells_that_a_part_meets() -> None:
    grid = grid_of([np.ones((2, 2, 1))])
    assert grid.fill_fraction(grid.parts[0]) == pytest.approx(0.25)
    assert grid.fill_fraction(replace(grid.parts[0], solid_volume_m3=4.0000001)) == 1.0
    assert grid.fill_fraction(replace(grid.parts[0], cells=0)) == 0.0
