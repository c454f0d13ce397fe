"""Boxes outside the site are sorted out early, with the same result."""

import gc
from pathlib import Path

import numpy as np
import pytest

from bimvox.errors import ObstructionFileError
from bimvox.grid.frame import GridFrame
from bimvox.site.obstructions import cells
from bimvox.site.obstructions.cells import obstruction_cells
from bimvox.site.obstructions.file import read_obstruction_file
from bimvox.site.obstructions.obstruction_set import Box, Obstruction


@pytest.mark.parametrize("grow_vox", [0, 2])
def test_the_same_cells_and_notes_as_without_sorting_out(grow_vox: int, monkeypatch: pytest.MonkeyPatch) -> None:
    frame, shape, random = GridFrame((-1.0, 2.0, -0.5), 0.5), (6, 7, 4), np.random.default_rng(1)
    boxes = []
    for _ in range(300):
        low = random.uniform(-6.0, 9.0, 3)
        boxes.append(Box(tuple(low), tuple(low + random.uniform(0.1, 2.0, 3))))
    found = [obstruction_cells(Obstruction("a", box), frame, shape, None, grow_vox=grow_vox) for box in boxes]
    monkeypatch.setattr(cells, "_is_far", lambda *_: False)
    slow = [obstruction_cells(Obstruction("a", box), frame, shape, None, grow_vox=grow_vox) for box in boxes]
    for (fast_cells, fast_note), (slow_cells, slow_note) in zip(found, slow, strict=True):
        np.testing.assert_array_equal(fast_cells, slow_cells)
        assert fast_note == slow_note
    assert {bool(len(one)) for one, _ in found} == {True, False}


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
