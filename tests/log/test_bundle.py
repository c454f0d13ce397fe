from __future__ import annotations

import dataclasses
import io
import json
import re
import zipfile

import numpy as np
import pytest
from log_building import same, tiny_site

from bimvox.bim.building import TriangleMesh
from bimvox.errors import LogFileError
from bimvox.log.bundle import SiteWriter, pack, site_from_bytes, site_to_bytes, unpack
from bimvox.log.codec import ArrayWriter, encode
from bimvox.log.mcap.form import Encoded, json_text
from bimvox.site.site import Blocker


@pytest.mark.parametrize("crane", [True, False])
def test_a_site_comes_back_exactly(crane: bool) -> None:
    site = tiny_site(crane=crane)
    same(site_from_bytes(site_to_bytes(site), "log"), site)


def test_an_access_comes_back_and_fits_the_grid() -> None:
    site = dataclasses.replace(tiny_site(), access=tiny_site().yard)
    back = site_from_bytes(site_to_bytes(site), "log")
    assert np.array_equal(back.access, site.yard)
    wrong = dataclasses.replace(site, access=site.yard[:-1])
    with pytest.raises(LogFileError, match=r"site\.access"):
        site_from_bytes(site_to_bytes(wrong), "log")


def test_the_same_site_gives_the_same_bytes() -> None:
    assert site_to_bytes(tiny_site()) == site_to_bytes(tiny_site())
    with zipfile.ZipFile(io.BytesIO(site_to_bytes(tiny_site()))) as archive:
        assert {info.date_time for info in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}


def test_meshes_keep_every_bit() -> None:
    site = tiny_site()
    back = site_from_bytes(site_to_bytes(site), "log")
    for before, after in zip(site.components, back.components, strict=True):
        assert before.mesh.vertices_m.tobytes() == after.mesh.vertices_m.tobytes()
        assert not after.mesh.vertices_m.flags.writeable


@pytest.mark.parametrize("keep", [0, 1, 100, 0.5, 0.9, -1])
def test_a_truncated_bundle_is_an_error(keep: float) -> None:
    data = site_to_bytes(tiny_site())
    cut = data[: int(keep * len(data)) if isinstance(keep, float) else keep]
    with pytest.raises(LogFileError, match="cannot be read"):
        site_from_bytes(cut, "cut.mcap")


def test_a_flipped_byte_is_an_error_or_harmless() -> None:
    site = tiny_site()
    data = site_to_bytes(site)
    for position in range(0, len(data), max(1, len(data) // 200)):
        damaged = bytearray(data)
        damaged[position] ^= 0x5A
        try:
            same(site_from_bytes(bytes(damaged), "flipped.mcap"), site)  # in a zip field that is never read
        except LogFileError:
            continue


def edited(**changes: object) -> bytes:
    members = unpack(site_to_bytes(tiny_site()))
    document = json.loads(members["site.json"])
    for dotted, value in changes.items():
        at = document
        *way, last = dotted.split("__")
        for key in way:
            at = at[int(key)] if isinstance(at, list) else at[key]
        if isinstance(at, list):
            at[int(last)] = value
        else:
            at[last] = value
    return pack(members | {"site.json": json.dumps(document).encode()})


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"version": 99}, "version 99"),
        ({"format": "other"}, "not a site"),
        ({"site__rules__rope": "yes"}, r"site\.rules\.rope: 'yes' is not bool"),
        ({"site__colour": "red"}, "unknown key 'colour'"),
        ({"site__frame__voxel_size_m": -1.0}, "not positive"),
        ({"site__frame__origin_m": [0.0, 1.0]}, "2 values instead of 3"),
        ({"site__labels": {"dtype": "uint8", "start": 0, "shape": [1 << 40, 1, 1]}}, "past the end"),
        ({"site__labels": {"dtype": "uint8", "start": -1, "shape": [1, 1, 1]}}, "impossible shape"),
        ({"site__labels": {"dtype": "object", "start": 0, "shape": [1]}}, "not a reference"),
        ({"site__components__1__target_vox": [11, 0, 1]}, "ok"),
        ({"site__components__1__target_vox": [12, 0, 1]}, "outside the grid"),
        ({"site__components__1__index": 7}, "7 instead of 1"),
        ({"site__components__1__stored_pose": "upside_down"}, "is not one of as_built"),
        ({"site__blockers": None}, "not a list"),
    ],
)
def test_a_bundle_that_contradicts_itself_is_an_error(changes: dict[str, object], message: str) -> None:
    if message == "ok":
        site_from_bytes(edited(**changes), "log")
        return
    with pytest.raises(LogFileError, match=message):
        site_from_bytes(edited(**changes), "log")


def test_boxes_that_are_not_the_cells_are_an_error() -> None:
    site = tiny_site()
    first = site.components[0]
    wrong = dataclasses.replace(first.shape, boxes=np.array([[0, 0, 0, 1, 1, 2], [0, 0, 1, 1, 1, 3]], np.int32))
    broken = dataclasses.replace(site, components=(dataclasses.replace(first, shape=wrong), *site.components[1:]))
    with pytest.raises(LogFileError, match="union is not the cells"):
        site_from_bytes(site_to_bytes(broken), "log")


def test_a_face_beyond_the_vertices_is_an_error() -> None:
    site = tiny_site()
    first = site.components[0]
    wrong = dataclasses.replace(first.mesh, faces=first.mesh.faces + 1)
    broken = dataclasses.replace(site, components=(dataclasses.replace(first, mesh=wrong), *site.components[1:]))
    with pytest.raises(LogFileError, match="a face refers to a missing vertex"):
        site_from_bytes(site_to_bytes(broken), "log")


def test_a_part_without_faces_is_an_error_that_names_it() -> None:
    site = tiny_site()
    first = site.components[0]
    bare = dataclasses.replace(first, mesh=dataclasses.replace(first.mesh, faces=np.zeros((0, 3), np.int32)))
    broken = dataclasses.replace(site, components=(bare, *site.components[1:]))
    with pytest.raises(LogFileError, match=re.escape(f"components[0].mesh: {first.label} has no faces")):
        site_from_bytes(site_to_bytes(broken), "log")


def test_structure_without_faces_is_an_error_that_names_it() -> None:
    bare = TriangleMesh(np.zeros((3, 3)), np.zeros((0, 3), np.int32))
    wall = Blocker("wall", "structure", np.array([[1, 1, 1]], np.int32), bare)
    broken = dataclasses.replace(tiny_site(), blockers=(wall,))
    with pytest.raises(LogFileError, match=re.escape("blockers[0].mesh: wall has no faces")):
        site_from_bytes(site_to_bytes(broken), "log")


def test_a_pickle_inside_is_never_run() -> None:
    buffer = io.BytesIO()
    np.save(buffer, np.array([{"x": 1}], object), allow_pickle=True)
    members = unpack(site_to_bytes(tiny_site()))
    with pytest.raises(LogFileError, match=r"float64\.npy"):
        site_from_bytes(pack(members | {"float64.npy": buffer.getvalue()}), "log")


def test_a_zip_bomb_is_refused_before_it_is_unpacked() -> None:
    data = bytearray(pack({"site.json": b"{}"}))
    at = data.index(b"PK\x01\x02")  # the central directory, which the reader relies on
    data[at + 24 : at + 28] = (3 << 30).to_bytes(4, "little")
    with pytest.raises(LogFileError, match="claims"):
        site_from_bytes(bytes(data), "bomb.mcap")


def test_sites_that_share_much_are_written_as_each_by_itself() -> None:
    site = tiny_site()
    writer = SiteWriter(site)
    assert writer.to_bytes(site) == site_to_bytes(site)
    ground, *others = site.blockers
    named = Blocker('{"dtype":"int32","start":7', "obstruction", ground.cells[:5])
    for blockers in ((ground,), (ground, named, *others), (named, ground)):
        changed = dataclasses.replace(site, blockers=blockers, notes=("one", '"dtype":"int32","start":3'))
        assert writer.to_bytes(changed) == SiteWriter(changed).to_bytes(changed) == site_to_bytes(changed)
        same(site_from_bytes(writer.to_bytes(changed), "log"), changed)


def test_a_text_that_looks_like_a_reference_stays_as_it_is() -> None:
    value = {"a": np.arange(3, dtype=np.int32), '"dtype":"int32","start":1': '{"dtype":"int32","start":2,'}
    arrays, again = ArrayWriter(), ArrayWriter()
    for writer in (arrays, again):
        writer.put(np.zeros(5, np.int32))
    assert Encoded(value).text(arrays) == json_text(encode(value, again))
    assert arrays.flat()["int32"].tolist() == again.flat()["int32"].tolist()
