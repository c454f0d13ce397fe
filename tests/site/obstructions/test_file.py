import json
from pathlib import Path

import numpy as np
import pytest
from box_sites import box_mesh

from bimvox.bim.building import TriangleMesh
from bimvox.errors import FileError, ObstructionFileError
from bimvox.site.obstructions.file import (
    FORMS,
    obstructions_json_schema,
    obstructions_to_json,
    parse_obstructions,
    without_references,
)
from bimvox.site.obstructions.obstruction_set import Box, Cylinder, Obstruction, ObstructionSet, Points, Voxels

BOX = {"min": [0, 0, 0], "max": [1, 2, 3]}


def parse(value, name="site.json", folder=Path("nowhere"), **more):
    data = value if isinstance(value, bytes) else json.dumps(value).encode()
    return parse_obstructions(data, name, folder, **more)


def file_of(*entries, **more):
    return {"version": 1, "unit": "m", "obstructions": list(entries), **more}


def error_of(value, name="site.json", folder=Path("nowhere"), **more) -> ObstructionFileError:
    with pytest.raises(ObstructionFileError) as caught:
        parse(value, name, folder, **more)
    return caught.value


def test_every_form_is_read_in_metres(tmp_path):
    (tmp_path / "spoil.ply").touch()
    (tmp_path / "scan.xyz").write_text("1000 2000 0\n0 0 500\n")
    asked = []

    def read_mesh(path: Path, unit: str) -> TriangleMesh:
        asked.append((path.name, unit))
        return box_mesh((0, 0, 0), (1, 1, 1))

    found = parse(
        file_of(
            {"id": "truck", "box": {"min": [0, 500, 0], "max": [1000, 2000, 3000]}},
            {"id": "stack", "voxels": [[3, 5, 1], [3, 4, 1], [3, 5, 1]]},
            {"id": "silo", "cylinder": {"base": [8000, 3000, 0], "radius": 1200, "height": 6000}},
            {"id": "spoil", "mesh": "spoil.ply"},
            {"id": "scan", "points": "scan.xyz"},
            unit="mm",
        ),
        folder=tmp_path,
        read_mesh=read_mesh,
    )
    forms = {one.id: one.form for one in found.obstructions}
    assert forms["truck"] == Box((0.0, 0.5, 0.0), (1.0, 2.0, 3.0))
    assert forms["stack"] == Voxels(((3, 4, 1), (3, 5, 1)))
    assert forms["silo"] == Cylinder((8.0, 3.0, 0.0), 1.2, 6.0)
    assert isinstance(forms["spoil"], TriangleMesh)
    assert asked == [("spoil.ply", "mm")]
    assert isinstance(forms["scan"], Points)
    np.testing.assert_allclose(forms["scan"].points_m, [[1.0, 2.0, 0.0], [0.0, 0.0, 0.5]])
    assert found.files == (tmp_path / "spoil.ply", tmp_path / "scan.xyz")


def test_obstructions_given_as_a_value_are_written_as_a_file():
    given = ObstructionSet.of(
        [
            Obstruction("truck", Box((0.1, 0.5, 0.0), (1.0, 2.0, 1 / 3))),
            Obstruction("silo", Cylinder((5.0, 5.0, 0.0), 0.7, 9.0)),
            Obstruction("stack", Voxels(((3, 4, 1), (3, 5, 1)))),
            Obstruction("heap", box_mesh((0, 0, 0), (1, 1, 1))),
            Obstruction("scan", Points(np.zeros((1, 3)))),
        ]
    )
    data, refers = without_references(obstructions_to_json(given), "obstructions.json")
    assert refers == {"heap", "scan"}
    wanted = [one for one in given.obstructions if one.id not in refers]
    assert [(one.id, one.form) for one in parse(data).obstructions] == [(one.id, one.form) for one in wanted]


def test_toml_and_feet():
    text = b'version = 1\nunit = "ft"\n[[obstructions]]\nid = "t"\nbox = { min = [0, 0, 0], max = [10, 10, 10] }\n'
    (one,) = parse(text, "site.TOML").obstructions
    assert one.form.high_m == pytest.approx((3.048,) * 3)


def test_the_digest_is_of_the_content_not_of_the_file():
    one, two = {"id": "a", "box": BOX}, {"id": "b", "voxels": [[1, 1, 1]]}
    digest = parse(file_of(one, two)).digest
    assert parse(file_of(two, one)).digest == digest
    assert parse(json.dumps(file_of(one, two), indent=3).encode(), "other.json").digest == digest
    in_mm = {"id": "a", "box": {"min": [0, 0, 0], "max": [1000, 2000, 3000]}}
    assert parse(file_of(in_mm, two, unit="mm")).digest == digest
    for other in (
        file_of(one),
        file_of(one, {"id": "c", "voxels": [[1, 1, 1]]}),
        file_of(one, {"id": "b", "voxels": [[1, 1, 2]]}),
        file_of({"id": "a", "box": {"min": [0, 0, 0], "max": [1, 2, 3.0001]}}, two),
    ):
        assert parse(other).digest != digest


@pytest.mark.parametrize(
    ("value", "key", "said"),
    [
        ({"version": 1}, "obstructions", "missing"),
        ({"obstructions": []}, "version", "add it: 1"),
        (file_of(version=2), "version", "1"),
        (file_of(unit="yd"), "unit", "'m', 'mm' or 'ft'"),
        (file_of(obstruction=[]), "obstruction", "did you mean 'obstructions'"),
        (file_of({"box": BOX}), "obstructions[0].id", "missing"),
        (file_of({"id": "a"}), "obstructions[0]", "exactly one of"),
        (file_of({"id": "a", "box": BOX, "mesh": "x.ply"}), "obstructions[0]", "box and mesh"),
        (file_of({"id": "a", "bx": BOX}), "obstructions[0].bx", "did you mean 'box'"),
        (file_of({"id": "a", "box": {"min": [0, 0, 0]}}), "obstructions[0].box.max", "missing"),
        (file_of({"id": "a", "box": {"min": [0, 0, 0], "max": [1, 0, 1]}}), "obstructions[0].box", "larger than min"),
        (file_of({"id": "a", "box": {"min": [0, 0, "0"], "max": [1, 1, 1]}}), "obstructions[0].box.min[2]", "number"),
        (file_of({"id": "a", "voxels": []}), "obstructions[0].voxels", "at least 1"),
        (file_of({"id": "a", "voxels": [[1, 2, 0.5]]}), "obstructions[0].voxels[0][2]", "whole number"),
        (file_of({"id": "a", "voxels": [[1, 2, 10**20]]}), "obstructions[0].voxels[0][2]", "less than"),
        (file_of({"id": "a", "cylinder": {"base": [0, 0, 0], "radius": 0, "height": 1}}),
         "obstructions[0].cylinder.radius", "greater than 0"),
        (file_of({"id": "crane", "box": BOX}), "obstructions[0].id", "reserved for the site"),
        (file_of({"id": "a", "points": "none.ply"}), "obstructions[0].points", "no such file"),
        (file_of({"id": "a", "mesh": "none.ply"}), "obstructions[0].mesh", "no such file"),
        ([1, 2], None, "a table"),
    ],
)  # fmt: skip
def test_a_wrong_entry_is_named_by_its_key(value, key, said):
    error = error_of(value)
    assert error.key == key
    assert said in str(error)


def test_ids_are_unique():
    error = error_of(file_of({"id": "a", "box": BOX}, {"id": "b", "box": BOX}, {"id": "a", "box": BOX}))
    assert "obstructions[2].id" in str(error)
    assert "'a' is already the id of obstructions[0]" in str(error)


@pytest.mark.parametrize(
    ("data", "name", "said"),
    [
        (b'{"version": 1,\n "obstructions": [\n  {"id" "a"}]}', "a.json", "line 3, column 9"),
        (b'{"version": 1, "obstr', "a.json", "line 1"),
        (b"version = 1\nunit = m\n", "a.toml", "line 2"),
        (b'{"version": 1,\n "x": "\xff"}', "a.json", "line 2"),
        (b"", "a.json", "empty"),
        (b"[" * 100_000, "a.json", "nested too deeply"),
        (b'{"version": 1, "obstructions": [{"id": "a", "id": "b"}]}', "a.json", "'id' occurs twice"),
        (b'{"version": 1, "obstructions": [{"id":"a","box":{"min":[NaN,0,0],"max":[1,1,1]}}]}', "a.json", "finite"),
    ],
)
def test_a_broken_file_says_where(data, name, said):
    assert said in str(error_of(data, name))


def test_a_broken_mesh_is_an_error_of_the_entry(tmp_path):
    (tmp_path / "spoil.stl").write_bytes(b"nothing")

    def read_mesh(path: Path, unit: str) -> TriangleMesh:
        raise FileError(path, "garbage")

    error = error_of(file_of({"id": "a", "mesh": "spoil.stl"}), folder=tmp_path, read_mesh=read_mesh)
    assert error.key == "obstructions[0].mesh"
    assert "garbage" in str(error)


def test_the_schema_describes_the_file():
    schema = json.loads(json.dumps(obstructions_json_schema()))
    entry = schema["$defs"]["ObstructionEntry"]
    assert set(entry["properties"]) == {"id", *FORMS}
    assert len(entry["oneOf"]) == len(FORMS)


def _box(name: str, at: float = 0.0) -> dict[str, object]:
    return {"id": name, "box": {"min": [at, 0, 0.5], "max": [at + 1.0, 1, 2]}}


def _toml(entry: dict[str, object]) -> str:
    if "voxels" in entry:
        return f"voxels = {entry['voxels']}"
    box = entry["box"]
    return f"box = {{min = {box['min']}, max = {box['max']}}}"


@pytest.mark.parametrize("unit", ["m", "ft"])
@pytest.mark.parametrize("suffix", ["json", "toml"])
def test_boxes_among_other_forms_keep_their_places(unit: str, suffix: str) -> None:
    entries = [_box("b", 3.0), {"id": "v", "voxels": [[1, 2, 3]]}, _box("a"), _box("Stütze\u00a0")]
    text = json.dumps({"version": 1, "unit": unit, "obstructions": entries})
    if suffix == "toml":
        rows = [f"{{id = {json.dumps(one['id'])}, {_toml(one)}}}" for one in entries]
        text = f"version = 1\nunit = '{unit}'\nobstructions = [{', '.join(rows)}]\n"
    found = parse_obstructions(text.encode(), f"o.{suffix}", Path()).obstructions
    assert [one.id for one in found] == ["Stütze\u00a0", "a", "b", "v"]
    scale = {"m": 1.0, "ft": 0.3048}[unit]
    assert found[2].form == Box((3.0 * scale, 0.0, 0.5 * scale), (4.0 * scale, 1.0 * scale, 2.0 * scale))


@pytest.mark.parametrize(
    ("entries", "key"),
    [
        ([_box("a"), {"id": "x", "box": {"min": [0, 0, 0], "max": [0, 1, 1]}}], "obstructions[1].box"),
        ([_box("a"), _box("b"), {"id": "x"}], "obstructions[2]"),
        ([_box("a"), _box("b"), _box("a")], "obstructions[2].id"),
        ([_box("a"), {"id": "a", "voxels": [[0, 0, 0]]}], "obstructions[1].id"),
        ([_box("a"), _box("crane")], "obstructions[1].id"),
        ([_box("a"), _box("b" * 1001)], "obstructions[1].id"),
        ([_box("a"), {"id": "x", "box": {"min": [0, 0, True], "max": [1, 1, 2]}}], "obstructions[1].box.min[2]"),
        ([_box("a"), {"id": "x", "box": {"min": [0, 0, 0], "max": [1, 1, 2e9]}}], "obstructions[1].box.max[2]"),
        ([_box("a"), [_box("b")]], "obstructions[1]"),
        ([_box("a"), {"id": "x", "box": _box("b")}], "obstructions[1].box"),
    ],
)
def test_a_fault_among_boxes_is_told_with_its_place(entries: list[object], key: str) -> None:
    with pytest.raises(ObstructionFileError) as caught:
        parse_obstructions(json.dumps({"version": 1, "obstructions": entries}).encode(), "o.json", Path())
    assert f"{caught.value}".startswith(f"o.json: {key}")
    assert "Obstruction(" not in str(caught.value)


def test_a_box_in_place_of_a_file_is_refused() -> None:
    with pytest.raises(ObstructionFileError, match=r"o\.json: version is missing|unknown key"):
        parse_obstructions(json.dumps(_box("a")).encode(), "o.json", Path())
