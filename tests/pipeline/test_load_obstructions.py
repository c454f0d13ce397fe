"""Obstructions that are given as scan files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from box_sites import box_site

from bimvox.errors import BimvoxError
from bimvox.library.obstructions import load_obstructions
from bimvox.site.obstructions.obstruction_set import Points

PLY = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\nend_header\n"


def site():
    return box_site([("beam", (1.0, 1.0, 0.0), (4.0, 2.0, 1.0))], shape=(24, 12, 10))


@pytest.mark.parametrize(("name", "text"), [("scan.ply", PLY + "1 2 3\n4 5 6\n"), ("scan.xyz", "1 2 3\n4 5 6\n")])
def test_a_scan_is_an_obstruction(tmp_path: Path, name: str, text: str):
    (tmp_path / name).write_text(text)
    (obstruction,) = load_obstructions(tmp_path / name, site()).obstructions
    assert obstruction.id == "scan"
    assert isinstance(obstruction.form, Points)
    np.testing.assert_array_equal(obstruction.form.points_m, [[1, 2, 3], [4, 5, 6]])


def test_a_truncated_scan_says_so(tmp_path: Path):
    (tmp_path / "scan.ply").write_text(PLY + "1 2 3\n")
    with pytest.raises(BimvoxError, match=r"scan\.ply.*truncated: 1 of 2"):
        load_obstructions(tmp_path / "scan.ply", site())
