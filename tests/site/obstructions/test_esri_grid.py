"""ESRI ASCII grids: keys in any order, cells as blocks, and what is wrong by its line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bimvox.errors import BimvoxError
from bimvox.grid.frame import GridFrame
from bimvox.library.site import rasterise
from bimvox.site.obstructions.cells import Where, obstruction_cells
from bimvox.site.obstructions.esri_grid import is_esri_grid, read_esri_grid, surface_of
from bimvox.site.obstructions.obstruction_set import Obstruction

HEAD = "ncols 3\nnrows 2\nxllcorner 10\nyllcorner 5\ncellsize 2\n"
BODY = "1 2.5 3\n4 -9999 6\n"
WANTED = np.array([[1.0, 2.5, 3.0], [4.0, np.nan, 6.0]])


def written(folder: Path, text: str, name: str = "a.asc") -> Path:
    (folder / name).write_bytes(text.encode())
    return folder / name


@pytest.mark.parametrize(
    "text",
    [
        HEAD + BODY,
        HEAD + "NODATA_value -9999\n" + BODY,
        "\ufeffNROWS 2\r\nNCOLS 3\r\nCELLSIZE 2,0\r\nYLLCORNER 5,0\r\nXLLCORNER 10,0\r\n1,0 2,5 3\r\n4 -9999 6,0\r\n",
        "nodata_value 1e30\nxllcenter 11\nyllcenter 6.0\ndx 2\ndy 2.0\nnrows 2\nncols 3\n1 2.5 3 4\n1e30 6",
        "NCols\t3\nNRows\t2\nXLLCentre 11\nYLLCorner 5\nCellSize 2\nNODATA -3.4028234663852886e+38\n"
        "1 2.5 3\n\n4 -3.402823e+38 6\n",
        "ncols=3\nnrows = 2\nxllcorner= 10\nyllcorner: 5\ncellsize: 2\nnodata_value nan\n1 2.5 3\n4 nan 6\n",
    ],
)
def test_keys_in_any_order_are_read(tmp_path, text):
    path = written(tmp_path, text)
    assert is_esri_grid(path)
    grid = read_esri_grid(path)
    assert (grid.x, grid.y, grid.dx, grid.dy) == (10.0, 5.0, 2.0, 2.0)
    np.testing.assert_array_equal(grid.heights, WANTED)
    assert str(grid) == "ESRI grid of 3 x 2 cells, 2 each, 1 empty"


@pytest.mark.parametrize("unit_m", [1.0, 0.3048])
def test_each_cell_is_a_block_up_to_its_height(tmp_path, unit_m):
    mesh = surface_of(written(tmp_path, HEAD + BODY), unit_m)
    bottom = 1.0 - 1.0 / unit_m
    volume = sum(4.0 * (height - bottom) for height in (1.0, 2.5, 3.0, 4.0, 6.0))
    assert mesh.signed_volume_m3 == pytest.approx(volume * unit_m**3)
    np.testing.assert_allclose(mesh.bounds_m, np.array([[10, 5, bottom], [16, 9, 6]]) * unit_m)


def test_the_cells_of_the_site_are_those_below_the_heights(tmp_path):
    mesh = surface_of(written(tmp_path, HEAD.replace("cellsize 2", "dx 2\ndy 1") + BODY))
    frame, shape = GridFrame((9.0, 4.0, -0.5), 0.5), (20, 12, 20)
    cells, where = obstruction_cells(Obstruction("hill", mesh), frame, shape, rasterise)
    assert where is Where.INSIDE
    wanted = np.zeros(shape, bool)
    for row, south in ((0, 4), (1, 2)):
        for column, height in enumerate(WANTED[row]):
            if not np.isnan(height):
                first = 2 + 4 * column
                wanted[first : first + 4, south : south + 2, 1 : 1 + int(np.ceil(height / 0.5))] = True
    found = np.zeros(shape, bool)
    found[tuple(cells.T)] = True
    np.testing.assert_array_equal(found, wanted)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (HEAD + "1 2 3\n4 5\n", r"5 heights instead of 2 x 3: line 7 has 2"),
        (HEAD + "1 2 3\n4 5 6 7\n", r"7 heights instead of 2 x 3: line 7 has 4"),
        (HEAD + "1 2 3\n4 five 6\n", r"line 7 is '4 five 6': 'five' is not a height"),
        (HEAD + "1,5 2.5 3\n4 5 6\n", r"line 6 is '1,5 2.5 3': decimal points and commas"),
        (HEAD + "1 2 3\n4 inf 6\n", "infinite height"),
        (HEAD + "-9999 -9999 -9999\n-9999 -9999 -9999\n", "all 6 cells are NODATA"),
        (HEAD, "ends before its heights"),
        ("ncols 3\n" + HEAD + BODY, "line 2 is 'ncols 3': ncols is already in line 1"),
        (HEAD + "zllcorner 3\n" + BODY, "line 6 is 'zllcorner 3': 'zllcorner' is not a key"),
        (HEAD.replace("nrows 2\n", "") + BODY, "without nrows"),
        (HEAD.replace("yllcorner 5\n", "") + BODY, "without yllcorner"),
        (HEAD.replace("cellsize 2\n", "dx 2\n") + BODY, "without cellsize"),
        (HEAD.replace("cellsize 2", "cellsize 0") + BODY, r"cell size is 0 \(line 5\)"),
        (HEAD.replace("ncols 3", "ncols 2.5") + BODY, r"ncols is 2.5 \(line 1\)"),
        (HEAD.replace("ncols 3", "ncols three") + BODY, "line 1 is 'ncols three': ncols needs one number"),
        (HEAD + "xllcenter 3\n" + BODY, r"xllcorner \(line 3\) and xllcenter \(line 6\)"),
    ],
)
def test_a_broken_grid_says_where(tmp_path, text, said):
    with pytest.raises(BimvoxError, match=said):
        surface_of(written(tmp_path, text))


def test_other_tables_are_not_grids(tmp_path):
    assert not is_esri_grid(written(tmp_path, "1 2 3\n4 5 6\n"))
    assert not is_esri_grid(written(tmp_path, "x y z\n4 5 6\n", "a.xyz"))
    assert is_esri_grid(written(tmp_path, HEAD + BODY, "a.txt"))
    assert not is_esri_grid(written(tmp_path, HEAD + BODY, "a.ply"))
