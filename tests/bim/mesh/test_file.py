"""Mesh files of every format: names, units, axes, roles, damaged files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from bimvox.bim.building import Role
from bimvox.bim.read import ReadOptions, read_building
from bimvox.errors import InputError, MeshError, SelectionError


def box(size: tuple[float, float, float] = (1, 2, 3), at: tuple[float, float, float] = (0, 0, 0)) -> trimesh.Trimesh:
    made = trimesh.creation.box(size)
    made.apply_translation(np.array(at) + np.array(size) / 2)
    return made


def write_ascii_stl(path: Path, **solids: trimesh.Trimesh) -> Path:
    path.write_text(
        "".join(
            trimesh.exchange.stl.export_stl_ascii(mesh).replace("solid", f"solid {name}", 1) + "\n"
            for name, mesh in solids.items()
        )
    )
    return path


@pytest.mark.parametrize("suffix", ["stl", "ply", "off", "obj"])
def test_a_lump_is_cut_into_numbered_bodies(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"lump.{suffix}"
    trimesh.util.concatenate([box(), box(at=(10, 0, 0))]).export(path)
    building = read_building(path)
    assert [element.id for element in building.elements] == ["body-0", "body-1"]
    assert [element.mass_kg for element in building.elements] == pytest.approx([6 * 2400] * 2)
    assert {element.mass_source for element in building.elements} == {"default"}
    assert building.bounds_m.tolist() == [[0, 0, 0], [11, 2, 3]]
    assert building.source.unit_assumed
    assert (
        building.notes[0]
        == "the file states no unit: metres and z up are assumed; set unit and up (--unit, --up) otherwise"
    )


def test_named_solids_of_ascii_stl(tmp_path: Path) -> None:
    path = write_ascii_stl(tmp_path / "two.stl", Column=box(), terrain=box(at=(5, 0, 0)))
    building = read_building(path)
    assert {element.name: element.role for element in building.elements} == {
        "Column": Role.COMPONENT,
        "terrain": Role.GROUND,
    }


def test_objects_and_groups_of_obj_with_latin1_names(tmp_path: Path) -> None:
    path = tmp_path / "a.obj"
    text = "o tür\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\no floor\nv 0 0 1\nv 1 0 1\nv 0 1 1\nf 4 5 6\n"
    path.write_bytes(text.encode("latin-1"))
    assert [(element.name, element.role) for element in read_building(path).elements] == [
        ("floor", Role.GROUND),
        ("tür", Role.COMPONENT),
    ]


@pytest.mark.parametrize("suffix", ["glb", "gltf"])
def test_gltf_nodes_are_instances_with_y_up(tmp_path: Path, suffix: str) -> None:
    scene = trimesh.Scene()
    scene.add_geometry(box((1, 3, 2)), geom_name="column", node_name="c10")
    mirrored = np.diag([-1.0, 1.0, 1.0, 1.0])
    mirrored[0, 3] = 8.0
    scene.add_geometry(scene.geometry["column"], geom_name="column", node_name="c2", transform=mirrored)
    scene.export(tmp_path / f"model.{suffix}") if suffix == "glb" else [
        (tmp_path / name).write_bytes(content) for name, content in scene.export(file_type="gltf").items()
    ]
    building = read_building(tmp_path / f"model.{suffix}")
    assert [element.id for element in building.elements] == ["c2", "c10"]
    assert [element.mesh.signed_volume_m3 for element in building.elements] == pytest.approx([6.0, 6.0])
    assert building.elements[1].mesh.bounds_m == pytest.approx(np.array([[0, -2, 0], [1, 0, 3]]))
    assert building.elements[0].mesh.bounds_m[:, 0] == pytest.approx([7, 8])
    assert not building.source.unit_assumed


def test_3mf_states_millimetres(tmp_path: Path) -> None:
    scene = trimesh.Scene()
    scene.add_geometry(box((1000, 2000, 3000)), geom_name="wall", node_name="wall")
    scene.export(tmp_path / "a.3mf")
    building = read_building(tmp_path / "a.3mf")
    assert (building.source.unit, building.source.unit_assumed) == ("mm", False)
    assert building.elements[0].mesh.signed_volume_m3 == pytest.approx(6.0)


def test_the_unit_option(tmp_path: Path) -> None:
    path = tmp_path / "a.unitsmm.STL"
    path.write_bytes(trimesh.exchange.stl.export_stl(box((4000, 200, 2500))))
    assumed = read_building(path)
    assert any("most likely mm" in note for note in assumed.notes)
    stated = read_building(path, ReadOptions(unit="mm"))
    assert stated.bounds_m[1] == pytest.approx([4.0, 0.2, 2.5])
    assert not stated.source.unit_assumed
    with pytest.raises(InputError, match="furlong"):
        read_building(path, ReadOptions(unit="furlong"))


def test_selection_by_names_with_wildcards(tmp_path: Path) -> None:
    path = write_ascii_stl(
        tmp_path / "s.stl", beam_1=box(), beam_2=box(at=(3, 0, 0)), core=box(at=(6, 0, 0)), ground=box(at=(9, 0, 0))
    )
    roles = {e.name: e.role for e in read_building(path, ReadOptions(select="beam_*, core")).elements}
    assert roles == {"beam_1": "component", "beam_2": "component", "core": "component", "ground": "ground"}
    roles = {e.name: e.role for e in read_building(path, ReadOptions(select="core")).elements}
    assert roles == {"beam_1": "structure", "beam_2": "structure", "core": "component", "ground": "ground"}
    with pytest.raises(SelectionError, match="beem") as caught:
        read_building(path, ReadOptions(select="core, beem_*"))
    assert "beam_1" in (caught.value.hint or "")
    with pytest.raises(SelectionError):
        read_building(path, ReadOptions(select=" , "))


def test_inside_out_bodies_are_turned(tmp_path: Path) -> None:
    inverted = box()
    inverted.invert()
    inverted.export(tmp_path / "a.ply")
    building = read_building(tmp_path / "a.ply")
    assert building.elements[0].mesh.signed_volume_m3 == pytest.approx(6.0)
    assert any("inside-out" in note for note in building.notes)


def test_far_meshes_get_a_whole_metre_origin(tmp_path: Path) -> None:
    path = tmp_path / "far.ply"
    far = box((1, 1, 1), (250_000.25, 5.0, 3.0))
    far.export(path)
    building = read_building(path)
    assert building.origin_m.tolist() == [250_000.0, 0.0, 0.0]
    assert building.bounds_m[0] == pytest.approx([0.25, 5.0, 3.0], abs=0.02)  # PLY is written in single precision


def test_not_a_number_is_dropped_and_nothing_left_is_an_error(tmp_path: Path) -> None:
    path = tmp_path / "nan.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv nan 0 0\nf 1 2 3\nf 1 2 4\n")
    building = read_building(path)
    assert len(building.elements[0].mesh.faces) == 1
    assert np.isfinite(building.bounds_m).all()
    path.write_text("v 0 0 0\nv 1 0 0\nv nan 1 0\nf 1 2 3\n")
    with pytest.raises(MeshError, match="no triangle"):
        read_building(path)
    (tmp_path / "empty.stl").write_text("solid Empty\nendsolid Empty")
    with pytest.raises(MeshError, match="no triangle"):
        read_building(tmp_path / "empty.stl")


def test_points_are_a_scan_and_not_a_building(tmp_path: Path) -> None:
    (tmp_path / "scan.ply").write_bytes(trimesh.PointCloud(np.eye(3)).export(file_type="ply"))
    (tmp_path / "scan.off").write_text("OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n")
    for name in ("scan.ply", "scan.off"):
        with pytest.raises(MeshError, match="holds 3 points but no faces: it is a scan") as caught:
            read_building(tmp_path / name)
        assert f'"points": "{name}"' in (caught.value.hint or "")
    (tmp_path / "lines.obj").write_text("v 0 0 0\nv 1 0 0\nl 1 2\n")
    with pytest.raises(MeshError, match="holds 1 lines but no faces"):
        read_building(tmp_path / "lines.obj")


def test_what_is_left_out_is_listed(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\no wall\nf 1 2 3\no line\nl 1 2\no flat\nf 1 1 2\n")
    building = read_building(tmp_path / "a.obj")
    assert [element.name for element in building.elements] == ["wall"]
    assert {(item.name, item.reason) for item in building.skipped} == {
        ("", "1 lines: no surface"),
        ("flat", "has no triangle with an area"),
    }


def test_bodies_of_one_name_are_numbered(tmp_path: Path) -> None:
    text = "v 0 0 0\nv 1 0 0\nv 0 1 0\no a\nf 1 2 3\no a\nf 1 2 3\no a#2\nf 1 2 3\no a\nf 1 2 3\n"
    (tmp_path / "a.obj").write_text(text)
    assert [element.id for element in read_building(tmp_path / "a.obj").elements] == ["a", "a#2", "a#3", "a#2#2"]


@pytest.mark.parametrize("suffix", ["stl", "ply", "obj"])
def test_y_up_is_turned_where_asked(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a.{suffix}"
    box((1, 5, 2)).export(path)
    building = read_building(path, ReadOptions(up="y"))
    assert building.bounds_m == pytest.approx(np.array([[0, -2, 0], [1, 0, 5]]))
    assert building.elements[0].mesh.signed_volume_m3 == pytest.approx(10)
    assert building.notes[0] == "the file states no unit: metres are assumed; set unit (--unit) otherwise"


def test_gltf_with_z_up_against_its_standard(tmp_path: Path) -> None:
    path = tmp_path / "a.glb"
    trimesh.Scene(box((1, 2, 5))).export(path)
    building = read_building(path, ReadOptions(up="z"))
    assert building.bounds_m[1].tolist() == [1, 2, 5]
    assert any("z up as requested" in note for note in building.notes)


def test_a_flipped_exponent_costs_only_its_faces(tmp_path: Path) -> None:
    data = bytearray(trimesh.exchange.stl.export_stl(trimesh.util.concatenate([box(), box(at=(5, 0, 0))])))
    data[84 + 12 : 84 + 16] = np.float32(1e30).tobytes()
    path = tmp_path / "a.stl"
    path.write_bytes(data)
    building = read_building(path)
    assert building.bounds_m.tolist() == [[0, 0, 0], [6, 2, 3]]
    assert any("dropped triangles without area or with an invalid corner: 1" in note for note in building.notes)


def test_a_damaged_file_is_named_with_its_format(tmp_path: Path) -> None:
    (tmp_path / "a.gltf").write_text(
        '{"asset": {"version": "2.0"}, "nodes": [{"mesh": 0}], "meshes": [{"primitives": 3}]}'
    )
    with pytest.raises(MeshError, match="primitives are damaged"):
        read_building(tmp_path / "a.gltf")
    (tmp_path / "a.gltf").write_text('{"asset": {"version": "2.0"}, "nodes": [{"mesh": 0, "children": 4}]}')
    with pytest.raises(MeshError, match=r"meshes\[0\] is referenced, but there are only 0"):
        read_building(tmp_path / "a.gltf")


def test_single_precision_far_from_the_origin_is_noted(tmp_path: Path) -> None:
    path = tmp_path / "far.stl"
    path.write_bytes(trimesh.exchange.stl.export_stl(box(at=(4_000_000.0, 0, 0))))
    assert any("single precision: true to 1.2e+02 mm" in note for note in read_building(path).notes)
    (tmp_path / "far.obj").write_text("v 4000000.125 0 0\nv 4000001.125 0 0\nv 4000000.125 1 0\nf 1 2 3\n")
    building = read_building(tmp_path / "far.obj")
    assert building.origin_m.tolist() == [4_000_000.0, 0, 0]
    assert building.bounds_m[0, 0] == 0.125
    assert not any("precision" in note for note in building.notes)


def test_sizes_that_ask_for_a_second_look(tmp_path: Path) -> None:
    box((0.002, 0.003, 0.004)).export(tmp_path / "tiny.stl")
    assert any(note.endswith("check the unit") for note in read_building(tmp_path / "tiny.stl").notes)
    box((40, 30, 50)).export(tmp_path / "heavy.stl")
    assert "in m its heaviest body weighs 144,000 t: check the unit" in read_building(tmp_path / "heavy.stl").notes
    trimesh.util.concatenate([box(), box(at=(1, 0, 0)), box(at=(5000, 0, 0))]).export(tmp_path / "stray.stl")
    assert any(
        "bodies more than 1000 m from the rest: body-2" in n for n in read_building(tmp_path / "stray.stl").notes
    )
