import numpy as np
import pytest

from bimvox.errors import FileError
from bimvox.site.obstructions.point_file import is_scan, read_points

POINTS = [[1.0, 2.0, 3.0], [-4.0, 5.5, 0.25]]
HEAD = "ply\nformat {} 1.0\nelement vertex 2\nproperty uchar red\nproperty {t} x\nproperty {t} y\nproperty {t} z\n"


def ply(order: str, kind: str, code: str) -> bytes:
    head = HEAD.replace("{}", order).replace("{t}", kind) + "element face 0\nproperty list uchar int v\nend_header\n"
    sign = ">" if "big" in order else "<"
    rows = np.array([(7, *p) for p in POINTS], [("r", "u1"), *((axis, sign + code) for axis in "xyz")])
    return head.encode() + rows.tobytes()


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("a.ply", ply("binary_little_endian", "float", "f4")),
        ("a.ply", ply("binary_big_endian", "double", "f8")),
        ("a.ply", HEAD.format("ascii", t="float").encode() + b"end_header\r\n9 1 2 3\r\n9 -4 5.5 0.25\r\n"),
        ("a.xyz", b"1 2 3 0 0 0\n# note\n-4 5.5 0.25 0 0 0\n"),
        ("a.csv", b"x,y,z,i\n1,2,3,9\n-4,5.5,0.25,9\n"),
        ("a.PTS", b"2\n1 2 3\n-4 5.5 0.25\n"),
        ("a.xyz", b"1;2;3\n-4;5,5;0,25\n"),
        ("a.xyz", b"x;y;z\r\n1,0;2,0;3,0\r\n-4,0;5,5;0,25\r\n"),
        ("a.xyz", b"1,0 2,0 3,0 255\n-4 5,5 0,25 0\n"),
        ("a.xyz", b"1\t2\t3\n-4\t5,5\t0,25\n"),
        ("a.xyz", b"1,0, 2,0, 3,0\n-4,0, 5,5, 0,25\n"),
        ("a.xyz", b"1, 2, 3\n-4,5.5, 0.25\n"),
        ("a.xyz", b"1.0,2.0,3.0 9 9\n-4.0,5.5,0.25 9 9\n"),
        ("a.txt", b"Rechtswert;Hochwert;Hoehe\n1,000;2;3\n-4;5,5;0,250\n"),
        ("a.csv", b'"x","y","z"\n"1,0","2,0","3,0"\n"-4,0","5,5","0,25"\n'),
        ("a.csv", b'"1,0";"2,0";"3,0"\n"-4,0";"5,5";"0,25"\n'),
        ("a.xyz", b"# from the scanner\nx y z\n1 2 3\n-4 5,5 2,5e-1\n"),
        ("a.csv", b"x,y,z,r,g,b\n1,2,3,9,9,9\n-4,5.5,0.25,9,9,9\n"),
    ],
)
def test_every_kind_is_read(tmp_path, name, data):
    (tmp_path / name).write_bytes(data)
    np.testing.assert_array_equal(read_points(tmp_path / name), POINTS)


@pytest.mark.parametrize(
    ("name", "data", "said"),
    [
        ("a.ply", ply("binary_little_endian", "float", "f4")[:-1], "truncated: 1 of 2"),
        ("a.ply", HEAD.format("ascii", t="float").encode() + b"end_header\n9 1 2 3\n", "truncated: 1 of 2"),
        ("a.ply", b"solid\n", "not a PLY"),
        ("a.ply", b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n", "lack x, y, z"),
        ("a.xyz", b"", "no points"),
        ("a.xyz", b"1 2\n3 4\n", "not a table"),
        ("a.xyz", b"1 2 3\n1 two 3\n", "not a table"),
        ("a.xyz", b"1 2 3\nnan 2 3\n", "not finite"),
        ("a.xyz", b"x;y;z\n1;2;3\n1.23,5;2;3\n", "line 3 can be read in two ways"),
        ("a.xyz", b"1.5;2;3\n1,5;2;3\n", "line 2 can be read in two ways.*different decimal marks"),
        ("a.txt", b"x y z\n\n405.123 5,5 12,0\n", "line 3 can be read in two ways.*'405.123' has a thousands"),
        ("a.xyz", b"405,123 5.5 12.0\n", "line 1 can be read in two ways.*'405,123' has a thousands"),
        ("a.xyz", b"405.123,45 5,812.5 12\n", "line 1 can be read in two ways"),
        ("a.xyz", b"5,812,000 405,123 12\n", "line 1 can be read in two ways.*columns or thousands"),
        ("a.csv", b"3,0,7,6,0,0\n3,0,7,6,0,1\n", "line 1 can be read in two ways.*columns or decimals"),
        ("a.csv", b"x,y,z\n12,500,3,250,7,000\n", "line 2 can be read in two ways"),
        ("a.csv", b"12,5,3,25,7\n12,5,3,25,7,5\n", "line 2 can be read in two ways"),
        ("a.xyz", b"1 2 3\n1,2,3\n", "line 2"),
        ("a.las", b"LASF", "not a LAS file"),
        ("a.laz", b"", "not a LAS file"),
        ("a.pcd", b"LASF", "unknown type of point file"),
    ],
)
def test_what_cannot_be_used_says_why(tmp_path, name, data, said):
    (tmp_path / name).write_bytes(data)
    with pytest.raises(FileError, match=said):
        read_points(tmp_path / name)
    with pytest.raises(FileError, match="cannot be read"):
        read_points(tmp_path / "none.ply")


@pytest.mark.parametrize(
    "data",
    [
        b"405.123,45 5.812.000,5 12,5\n405.124 5.812.001,25 7\n",
        b"405.123,45;5.812.000,5;12,5\n405.124,0;5.812.001,25;7,0\n",
        b"405,123.45 5,812,000.5 12.5\n405,124 5,812,001.25 7\n",
        b"405,123.45\t5,812,000.5\t12.5\t0,1\n405,124.0\t5,812,001.25\t7.0\t0,2\n",
        b"405 123,45; 5 812 000,5; 12,5\r\n405 124,0; 5 812 001,25; 7,0\r\n",
        b"405'123.45;5'812'000.5;12.5\n405'124;5'812'001.25;7\n",
        "405\u00a0123,45;5\u00a0812\u00a0000,5;12,5\n405124;5812001,25;7\n".encode(),
    ],
)
def test_thousands_are_read_if_they_can_only_be_thousands(tmp_path, data):
    (tmp_path / "a.txt").write_bytes(data)
    points = [[405123.45, 5812000.5, 12.5], [405124.0, 5812001.25, 7.0]]
    np.testing.assert_allclose(read_points(tmp_path / "a.txt"), points, rtol=1e-15)


def test_a_scan_is_distinguished_from_a_mesh(tmp_path):
    for name, data, scan in (
        ("a.ply", ply("binary_little_endian", "float", "f4"), True),
        ("b.ply", ply("ascii", "float", "f4").replace(b"face 0", b"face 2"), False),
        ("c.ply", b"not a PLY", False),
        ("d.laz", b"", True),
        ("e.csv", b"1 2 3", True),
        ("f.json", b"{}", False),
    ):
        (tmp_path / name).write_bytes(data)
        assert is_scan(tmp_path / name) is scan
    assert not is_scan(tmp_path / "none.ply")
