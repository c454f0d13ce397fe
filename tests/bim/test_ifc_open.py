"""Only whole IFC files are opened."""

from __future__ import annotations

import zipfile
from pathlib import Path

import pytest

from bimvox.bim.ifc_open import open_ifc
from bimvox.errors import IfcError

from .conftest import IfcMaker


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


@pytest.mark.parametrize("schema", ["IFC2X2_FINAL", "IFC5", "AP214"])
def test_other_schemas_are_refused_by_name(frame_file: Path, tmp_path: Path, schema: str) -> None:
    path = tmp_path / "a.ifc"
    path.write_text(frame_file.read_text().replace("'IFC4'", f"'{schema}'"))
    with pytest.raises(IfcError, match=schema):
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
