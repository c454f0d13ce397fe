from __future__ import annotations

import io
import struct
import zlib
from xml.etree import ElementTree

import numpy as np
from box_grids import grid_of, part, random_shares
from hypothesis import given, settings
from hypothesis import strategies as st

from bimvox.exporters.vti import write_vti
from bimvox.grid.frame import GridFrame, Label
from bimvox.grid.voxel_grid import VoxelGrid

DTYPES = {"UInt8": "<u1", "Int32": "<i4", "Float32": "<f4", "Float64": "<f8"}


def written(grid: VoxelGrid, **options: int) -> bytes:
    stream = io.BytesIO()
    write_vti(grid, stream, **options)
    return stream.getvalue()


def parsed(data: bytes) -> tuple[ElementTree.Element, dict[str, object]]:
    """Return the XML and the arrays of a file with appended, compressed blocks, read as VTK's specification says."""
    head, tail = data.split(b'<AppendedData encoding="raw">\n_')
    assert tail.endswith(b"\n</AppendedData>\n</VTKFile>\n")
    root = ElementTree.fromstring(head + b"</VTKFile>")
    assert root.attrib["header_type"] == "UInt64"
    assert root.attrib["compressor"] == "vtkZLibDataCompressor"
    arrays: dict[str, object] = {}
    for element in root.iter():
        if "offset" not in element.attrib:
            continue
        at = int(element.attrib["offset"])
        count, size, last = struct.unpack_from("<3Q", tail, at)
        packed = struct.unpack_from(f"<{count}Q", tail, at + 24)
        at += 24 + 8 * count
        plain = b""
        for n, length in enumerate(packed):
            block = zlib.decompress(tail[at : at + length])
            assert len(block) == (last if last and n == count - 1 else size)
            plain += block
            at += length
        kind = element.attrib["type"]
        values = plain.decode().split("\0")[:-1] if kind == "String" else np.frombuffer(plain, DTYPES[kind])
        arrays[element.attrib["Name"]] = values
    return root, arrays


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 999), st.tuples(*[st.integers(1, 19)] * 3), st.integers(1, 4))
def test_the_cell_arrays_are_those_of_the_grid(seed: int, shape: tuple[int, int, int], parts: int) -> None:
    shares = random_shares(seed, shape, parts)
    kinds = [Label.COMPONENT, Label.STRUCTURE, Label.GROUND, Label.COMPONENT]
    grid = grid_of(shares, [part(f"p{n}", label=kinds[n]) for n in range(parts)])
    _, arrays = parsed(written(grid))
    owner, label, met, fill = (arrays[key].reshape(shape[::-1]).T for key in ("owner", "label", "parts", "fill"))
    owners = grid.owners.dense()
    np.testing.assert_array_equal(owner, owners)
    np.testing.assert_array_equal(label, grid.label_table[owners + 1])
    count = (np.array(shares) > 0).sum(axis=0)
    np.testing.assert_array_equal(met, count)
    np.testing.assert_array_equal(fill[count > 1], np.array(shares).max(axis=0)[count > 1])
    assert np.isnan(fill[count == 1]).all()
    assert (fill[count == 0] == 0).all()


def test_frame_and_tables_are_written() -> None:
    grid = grid_of(
        [np.ones((3, 4, 5))],
        [part('a<&"ä', "IfcBeam")],
        frame=GridFrame((1.5, -2.0, 0.1), 0.25),
        origin_m=(4e5, 5e6, 1.0),
        georeference={"crs": "EPSG:25832", "scale": 1.0},
    )
    root, arrays = parsed(written(grid))
    image = root.find("ImageData")
    assert image.attrib["WholeExtent"] == image.find("Piece").attrib["Extent"] == "0 3 0 4 0 5"
    assert image.attrib["Origin"] == "1.5 -2.0 0.1"
    assert image.attrib["Spacing"] == "0.25 0.25 0.25"
    assert arrays["part_id"] == ['a<&"ä']
    assert arrays["part_class"] == ["IfcBeam"]
    assert arrays["source_origin_m"].tolist() == [4e5, 5e6, 1.0]
    assert arrays["georeference"] == ["crs=EPSG:25832", "scale=1.0"]


def test_air_alone_and_any_number_of_threads_give_a_file() -> None:
    _, arrays = parsed(written(grid_of([], shape=(3, 2, 9))))
    assert "part_id" not in arrays
    assert (arrays["owner"] == -1).all()
    grid = grid_of(random_shares(1, (20, 30, 40), 3))
    assert written(grid) == written(grid, threads=3)
