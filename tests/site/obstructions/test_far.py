"""Numbers at the end of the range, and the garbage collector."""

import gc
from pathlib import Path

import numpy as np
import pytest

from bimvox.errors import ObstructionFileError
from bimvox.grid.frame import GridFrame
from bimvox.site.obstructions.cells import obstruction_cells
from bimvox.site.obstructions.file import read_obstruction_file
from bimvox.site.obstructions.obstruction_set import Box, Obstruction


def test_numbers_at_the_end_of_the_range_warn_of_nothing() -> None:
    frame = GridFrame((0.0, 0.0, 0.0), 0.5)
    with np.errstate(all="raise"):
        everything = Obstruction("a", Box((-1e308, -1e308, -1e308), (1e308, 1e308, 1e308)))
        assert len(obstruction_cells(everything, frame, (2, 3, 4), None)[0]) == 24


def test_the_garbage_collector_is_on_again_whatever_a_file_holds(tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text('{"version": 1, "obstructions": []}')
    assert read_obstruction_file(tmp_path / "a.json").obstructions == ()
    assert gc.isenabled()
    (tmp_path / "a.json").write_text("{")
    with pytest.raises(ObstructionFileError):
        read_obstruction_file(tmp_path / "a.json")
    assert gc.isenabled()
