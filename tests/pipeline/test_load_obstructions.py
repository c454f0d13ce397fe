"""Obstructions that are given as files: scans, and files that cannot be used."""

from __future__ import annotations

from pathlib import Path

import bimvox_pipeline.plan as module
import numpy as np
import pytest
from box_sites import box_site

from bimvox.errors import BimvoxError, FileError
from bimvox.library.site import load_obstructions
from bimvox.progress import SilentProgress
from bimvox.site.obstructions.coordinates import Survey
from bimvox.site.obstructions.obstruction_set import Points

PLY = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\nend_header\n"


def site():
    return box_site([("beam", (1.0, 1.0, 0.0), (4.0, 2.0, 1.0))], shape=(24, 12, 10))


@pytest.mark.parametrize(("name", "text"), [("scan.ply", PLY + "1 2 3\n4 5 6\n"), ("scan.xyz", "1 2 3\n4 5 6\n")])
def test_a_scan_is_an_obstruction(tmp_path: Path, name: str, text: str):
    (tmp_path / name).write_text(text)
    (obstruction,) = load_obstructions(tmp_path / name, site(), Survey()).obstructions
    assert obstruction.id == "scan"
    assert isinstance(obstruction.form, Points)
    np.testing.assert_array_equal(obstruction.form.points_m, [[1, 2, 3], [4, 5, 6]])


def test_a_truncated_scan_says_so(tmp_path: Path):
    (tmp_path / "scan.ply").write_text(PLY + "1 2 3\n")
    with pytest.raises(BimvoxError, match=r"scan\.ply.*truncated: 1 of 2"):
        load_obstructions(tmp_path / "scan.ply", site(), Survey())


@pytest.mark.parametrize(
    ("name", "content"),
    [("o.json", "{"), ("o.toml", "[["), ("o.ply", "ply\nformat"), ("o.obj", "f 1 2 3\n"), ("o.ifc", "ISO;")],
)
def test_a_plan_refuses_a_bad_file_before_it_reads_its_site(monkeypatch, tmp_path, name, content):
    """A site takes its time, and nobody waits for it to learn that a small file is wrong."""
    read = []
    monkeypatch.setattr(module, "load_site", lambda *given: read.append(given))
    (tmp_path / name).write_text(content)
    (tmp_path / "a.site.toml").write_text("")
    with pytest.raises(FileError, match=name):
        module.plan(
            tmp_path / "a.site.toml", tmp_path / "a.mcap", obstructions=tmp_path / name, progress=SilentProgress()
        )
    assert not read
