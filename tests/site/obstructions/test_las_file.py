"""LAS and LAZ files, written by laspy."""

from pathlib import Path

import laspy
import numpy as np
import pytest

from bimvox.errors import FileError
from bimvox.site.obstructions.las_file import read_las

POINTS = np.array([[1.0, 2.0, 3.0], [-4.0, 5.5, 0.25]])
OFFSET = np.array([500_000.0, 0.0, 0.0])


def las(path: Path, version: str = "1.2") -> bytes:
    header = laspy.LasHeader(point_format=3 if version < "1.4" else 6, version=version)
    header.scales, header.offsets = np.full(3, 0.001), OFFSET
    file = laspy.LasData(header)
    file.xyz = POINTS + OFFSET
    file.write(path)
    return path.read_bytes()


@pytest.mark.parametrize("version", ["1.2", "1.3", "1.4"])
@pytest.mark.parametrize("name", ["a.las", "a.laz"])
def test_las_and_laz_are_read(tmp_path, name, version):
    las(tmp_path / name, version)
    np.testing.assert_allclose(read_las(tmp_path / name), POINTS + OFFSET, atol=1e-3)


@pytest.mark.parametrize("version", ["1.2", "1.4"])
@pytest.mark.parametrize("name", ["a.las", "a.laz"])
def test_a_damaged_las_file_is_refused(tmp_path, name, version):
    path = tmp_path / name
    data = las(path, version)
    random = np.random.default_rng(3)
    for cut in (3, 100, 227, len(data) - 30, len(data) - 1):
        path.write_bytes(data[:cut])
        with pytest.raises(FileError, match=r"truncated|not a LAS file|damaged LA[SZ] file|more than fit"):
            read_las(path)
    for _ in range(300 if name == "a.las" else 3):  # each in its own process
        spoilt = bytearray(data)
        for at in random.integers(0, len(data), 3):
            spoilt[at] = random.integers(256)
        path.write_bytes(spoilt)
        try:
            points = read_las(path)
        except FileError:
            continue
        assert np.isfinite(points).all()


def test_laz_without_laspy_says_what_to_install(tmp_path, monkeypatch):
    las(tmp_path / "a.laz")
    monkeypatch.setattr("bimvox.site.obstructions.las_file.find_spec", lambda name: None)
    with pytest.raises(FileError, match="laspy") as failed:
        read_las(tmp_path / "a.laz")
    assert "bimvox[scan]" in failed.value.hint
