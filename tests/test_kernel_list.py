"""The list of the kernels that the demo needs names kernels that exist."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path

import pytest

from bimvox import kernel_list
from bimvox.kernel_list import wanted, written

LIST = Path(kernel_list.__file__).with_name("kernels.json")


def test_every_kernel_of_the_list_exists_and_takes_as_many_arguments() -> None:
    entries = [one for act in json.loads(LIST.read_text()).values() for one in act]
    found = wanted()
    assert len(found) == len(entries) > 150
    assert len({one.file for one in found}) == len(found)
    for one in found:
        assert one.dispatcher.py_func.__code__.co_argcount == len(one.arguments), one.dispatcher


def test_an_act_needs_what_the_acts_before_it_need() -> None:
    counts = [len(wanted(act)) for act in json.loads(LIST.read_text())]
    assert counts == sorted(counts)
    assert 0 < counts[0] < len(wanted()) == counts[-1]
    with pytest.raises(ValueError, match="nothing"):
        wanted("nothing")


def test_a_kernel_that_is_no_longer_there_is_passed_over(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    gone = [["bimvox.voxelization.lattice:gone", "int64"], ["bimvox.gone:kernel"], ["bimvox.units:gone", "no_type"]]
    gone.append([json.loads(LIST.read_text())["voxelize"][0][0]])  # takes other arguments by now
    (tmp_path / "kernels.json").write_text(json.dumps({"voxelize": gone}))
    monkeypatch.setattr(kernel_list, "_LIST", tmp_path / "kernels.json")
    assert wanted() == []


def test_what_was_compiled_is_written_as_it_is_read(tmp_path: Path) -> None:
    some = wanted()[:12]
    for number, one in enumerate(some):
        one.compile()
        shutil.copy(one.file, tmp_path)
        os.utime(tmp_path / one.file.name, (number, number))
    entries = json.loads(LIST.read_text())["voxelize"][: len(some)]
    assert written(tmp_path, []) == entries
    assert written(tmp_path, [tmp_path / some[0].file.name]) == entries[1:]
