"""Only complete IFC files are opened."""

from __future__ import annotations

import re
import zipfile
from pathlib import Path

import pytest

from bimvox.bim.ifc.open import open_ifc
from bimvox.errors import IfcError

from ..conftest import IfcMaker


def opened(path: Path):  # type: ignore[no-untyped-def]
    return open_ifc(path, path.read_bytes())


@pytest.mark.parametrize("share", [0.1, 0.3, 0.6, 0.95])
def test_a_truncated_file_is_refused(frame_file: Path, tmp_path: Path, share: float) -> None:
    data = frame_file.read_bytes()
    path = tmp_path / "cut.ifc"
    path.write_bytes(data[: int(len(data) * share)])
    with pytest.raises(IfcError, match="truncated"):
        opened(path)


def test_a_hole_in_the_middle_is_refused_with_its_place(frame_file: Path, tmp_path: Path) -> None:
    path = tmp_path / "damaged.ifc"
    path.write_text(frame_file.read_text().replace("IFCCOLUMN(", "IFCCOLUMN((", 1))
    with pytest.raises(IfcError, match=r"damaged.*near line \d+"):
        opened(path)


def test_a_header_alone_has_no_project(frame_file: Path, tmp_path: Path) -> None:
    text = frame_file.read_text()
    path = tmp_path / "header.ifc"
    path.write_text(text[: text.index("DATA;")] + "DATA;\nENDSEC;\nEND-ISO-10303-21;\n")
    with pytest.raises(IfcError, match="0 IfcProject"):
        opened(path)


def test_two_projects_and_no_unit_are_refused(maker: type[IfcMaker], tmp_path: Path) -> None:
    two = maker()
    two.rooted("IfcProject", Name="second")
    with pytest.raises(IfcError, match="2 IfcProject"):
        opened(two.write(tmp_path / "two.ifc"))
    unitless = maker()
    unitless.project.UnitsInContext = None
    with pytest.raises(IfcError, match="length unit"):
        opened(unitless.write(tmp_path / "unitless.ifc"))


@pytest.mark.parametrize(("unit", "metres"), [("m", 1.0), ("mm", 0.001), ("ft", 0.3048)])
def test_the_unit(maker: type[IfcMaker], tmp_path: Path, unit: str, metres: float) -> None:
    found = opened(maker(unit=unit).write(tmp_path / "a.ifc"))
    assert (found.unit, found.metres_per_unit) == (unit, pytest.approx(metres))


@pytest.mark.parametrize(
    ("stated", "made", "read"), [("IFC4X3", "IFC4X3_ADD2", "IFC4X3_ADD2"), ("IFC4_ADD2", "IFC4", "IFC4")]
)
def test_schema_names_are_rewritten_in_memory(
    maker: type[IfcMaker], tmp_path: Path, stated: str, made: str, read: str
) -> None:
    path = maker(schema="IFC4X3" if made == "IFC4X3_ADD2" else made).write(tmp_path / "a.ifc")
    before = path.read_text().replace(f"'{made}'", f"'{stated}'")
    path.write_text(before)
    found = opened(path)
    assert found.schema == read
    assert any(stated in note for note in found.notes)
    assert path.read_text() == before


@pytest.mark.parametrize("schema", ["IFC1.5.1", "IFC5", "IFC4X4", "AP214"])
def test_other_schemas_are_refused_by_name(frame_file: Path, tmp_path: Path, schema: str) -> None:
    path = tmp_path / "a.ifc"
    path.write_text(frame_file.read_text().replace("'IFC4'", f"'{schema}'"))
    with pytest.raises(IfcError, match=schema):
        opened(path)


@pytest.mark.parametrize("stated", ["IFC2X_FINAL", "IFC2X2_FINAL", "IFC2X3_FINAL", "IFC2X3_TC1"])
def test_older_releases_are_read_as_ifc2x3_where_they_fit(maker: type[IfcMaker], tmp_path: Path, stated: str) -> None:
    made = maker(schema="IFC2X3")
    wall = made.box("IfcWall", Name="W")
    path = made.write(tmp_path / "a.ifc")
    text = path.read_text().replace("'IFC2X3'", f"'{stated}'", 1)
    path.write_text(text.replace("IFCWALL(", "IFCWALL($,", 1))
    found = opened(path)
    assert found.schema == "IFC2X3"
    assert any("1 IfcWall" in note for note in found.notes)
    at = text.index("IFCRECTANGLEPROFILEDEF(")
    path.write_text(text[:at] + text[at:].replace(");", ",$);", 1))
    assert any("1 IfcRectangleProfileDef" in note for note in opened(path).notes)
    path.write_text(re.sub(r"(IFCRECTANGLEPROFILEDEF\([^;]*),[^,]*\);", r"\1);", text))
    with pytest.raises(IfcError, match=rf"{stated} cannot be read as IFC2X3: .*1 IfcRectangleProfileDef"):
        opened(path)
    assert wall.is_a("IfcWall")


@pytest.mark.parametrize("stated", ["IFC4X3", "IFC4X3_TC1", "IFC4X3_ADD1", "IFC4X3_RC1", "IFC4X3_RC2", "IFC4X3_RC4"])
def test_candidates_of_ifc4x3_are_read_as_its_final_version(maker: type[IfcMaker], tmp_path: Path, stated: str) -> None:
    made = maker(schema="IFC4X3")
    made.box("IfcWall")
    path = made.write(tmp_path / "a.ifc")
    path.write_text(path.read_text().replace("'IFC4X3_ADD2'", f"'{stated}'", 1))
    assert opened(path).notes == (f"schema {stated} was read as IFC4X3_ADD2",)


def test_a_step_id_used_twice_is_refused(frame_file: Path, tmp_path: Path) -> None:
    text = frame_file.read_text()
    line = next(line for line in text.splitlines() if "=IFCBEAM(" in line)
    path = tmp_path / "twice.ifc"
    path.write_text(text.replace(line, f"{line}\n{line}"))
    with pytest.raises(IfcError, match=rf"twice, the first is {line.split('=')[0]}:"):
        opened(path)


def test_a_broken_value_is_refused_with_its_line(frame_file: Path, tmp_path: Path) -> None:
    text = frame_file.read_text()
    path = tmp_path / "broken.ifc"
    path.write_text(text.replace("IFCCARTESIANPOINT((0.,", "IFCCARTESIANPOINT((1.E999,", 1))
    line = (
        path.read_text().splitlines().index(next(row for row in path.read_text().splitlines() if "1.E999" in row)) + 1
    )
    with pytest.raises(IfcError, match=rf"1\.E999.* line {line}\b"):
        opened(path)


def test_dangling_references_and_unknown_values_are_noted(frame_file: Path, tmp_path: Path) -> None:
    text = frame_file.read_text()
    column = next(line for line in text.splitlines() if "=IFCCOLUMN(" in line)
    words = column.split(",")
    lost = ",".join([*words[:5], "#99999", *words[6:]])
    path = tmp_path / "a.ifc"
    path.write_text(text.replace(column, lost).replace(".METRE.", ".METRE.", 1).replace(".AREA.", ".AREAS.", 1))
    notes = " ".join(opened(path).notes)
    assert "references to missing instances: 1, the first to #99999" in notes
    assert "AREAS (IfcProfileTypeEnum)" in notes


@pytest.mark.parametrize(
    ("encoding", "name"),
    [("latin-1", "Träger Ø3"), ("utf-8-sig", "Träger Ø3"), ("utf-8", "Träger 梁 🏗"), ("ascii", "T")],
)
def test_text_in_other_encodings_is_read(frame_file: Path, tmp_path: Path, encoding: str, name: str) -> None:
    path = tmp_path / "a.ifc"
    path.write_bytes(frame_file.read_text().replace("'B1'", f"'{name}'").encode(encoding))
    assert opened(path).file.by_type("IfcBeam")[0].Name == name


@pytest.mark.parametrize(
    "content", [b"PK\x03\x04\x14\x00" * 50, b"%PDF-1.7\n" * 50, b"\x00" * 500, b"solid cube\n" * 9]
)
def test_another_kind_of_file_is_not_ifc(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "a.ifc"
    path.write_bytes(content)
    with pytest.raises(IfcError, match="not an IFC file"):
        opened(path)


def test_a_header_without_a_schema(frame_file: Path, tmp_path: Path) -> None:
    path = tmp_path / "a.ifc"
    path.write_text(frame_file.read_text().replace("FILE_SCHEMA", "FILE_SHEMA"))
    with pytest.raises(IfcError, match="FILE_SCHEMA"):
        opened(path)


def test_a_class_of_another_schema_is_noted(frame_file: Path, tmp_path: Path) -> None:
    path = tmp_path / "a.ifc"
    path.write_text(frame_file.read_text().replace("=IFCDOOR(", "=IFCTRAPDOOR("))
    assert any("1 IFCTRAPDOOR" in note for note in opened(path).notes)


def test_comments_do_not_count_as_instances(frame_file: Path, tmp_path: Path) -> None:
    path = tmp_path / "a.ifc"
    path.write_text("/* made by hand */\n" + frame_file.read_text().replace("DATA;", "DATA;\n/*\n#9999=IFCWALL();\n*/"))
    assert opened(path).notes == ()


def test_zipped(frame_file: Path, tmp_path: Path) -> None:
    path = tmp_path / "a.ifczip"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.write(frame_file, "folder/a.ifc")
        archive.writestr("readme.txt", "hello")
    assert len(opened(path).file.by_type("IfcColumn")) == 2
    path.write_bytes(path.read_bytes()[:-40])
    with pytest.raises(IfcError, match="zip"):
        opened(path)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("readme.txt", "hello")
    with pytest.raises(IfcError, match=r"0 \.ifc files"):
        opened(path)
    with zipfile.ZipFile(path, "w") as archive:
        archive.write(frame_file, "a.ifc")
        archive.write(frame_file, "b.ifc")
    with pytest.raises(IfcError, match=r"2 \.ifc files"):
        opened(path)


def test_a_zip_bomb_is_refused_before_it_is_unpacked(
    frame_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "bomb.ifczip"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("a.ifc", b"0" * (1 << 20))
    monkeypatch.setattr("bimvox.bim.ifc.step_file.MAX_UNZIPPED_BYTES", 1 << 19)
    monkeypatch.setattr(zipfile.ZipFile, "read", lambda *_: pytest.fail("was unpacked"))
    with pytest.raises(IfcError, match="unpacks to 1,048,576 bytes"):
        opened(path)


def test_a_zip_whose_directory_lies_about_the_size_is_refused(frame_file: Path, tmp_path: Path) -> None:
    path = tmp_path / "liar.ifczip"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.write(frame_file, "a.ifc")
    data = path.read_bytes()
    size = frame_file.stat().st_size.to_bytes(4, "little")
    path.write_bytes(data.replace(size, (100).to_bytes(4, "little")))
    with pytest.raises(IfcError, match=r"zip archive|truncated"):
        opened(path)
