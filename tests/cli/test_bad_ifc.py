"""Faults of real IFC files, through the command line: a typed error and nothing written, or a grid and a note."""

import io
import json
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest
from bimvox_cli.main import run

FRAME = (Path(__file__).parents[2] / "sample_models" / "frame.ifc").read_text()
LINES = FRAME.splitlines()


def line_of(text: str) -> str:
    return next(line for line in LINES if text in line)


def zipped(*names: str) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in names:
            archive.writestr(name, FRAME)
    return stream.getvalue()


def damaged_zip() -> bytes:
    data = bytearray(zipped("a.ifc"))
    data[200:260] = bytes(60)
    return bytes(data)


POINT = "IFCCARTESIANPOINT((6.2,0.2,0.))"
PROJECT = line_of("IFCPROJECT(")
METRE = "IFCSIUNIT(*,.LENGTHUNIT.,$,.METRE.);"


def length_unit(factor: str, base: str = "#992") -> str:
    """Return the frame in a unit that is this many metres long."""
    unit = "IFCCONVERSIONBASEDUNIT(#990,.LENGTHUNIT.,'FOOT',#991);\n#990=IFCDIMENSIONALEXPONENTS(1,0,0,0,0,0,0);"
    unit += f"\n#991=IFCMEASUREWITHUNIT({factor},{base});\n#992={METRE}"
    return FRAME.replace(METRE, unit)


def with_line(instance: str) -> str:
    """Return the frame with one more instance, #990."""
    return FRAME.replace("ENDSEC;\nEND-ISO", f"#990={instance};\nENDSEC;\nEND-ISO")


def kilogram(factor: str) -> str:
    """Return the frame with masses in a unit of this many kilograms."""
    unit = "IFCSIUNIT(*,.MASSUNIT.,.KILO.,.GRAM.);"
    made = "IFCCONVERSIONBASEDUNIT(#990,.MASSUNIT.,'POUND',#991);\n#990=IFCDIMENSIONALEXPONENTS(0,1,0,0,0,0,0);"
    return FRAME.replace(unit, f"{made}\n#991=IFCMEASUREWITHUNIT({factor},#992);\n#992={unit}")


BAD: dict[str, tuple[str, Callable[[], bytes | str], str, str]] = {
    "two projects": ("a.ifc", lambda: FRAME.replace(PROJECT, f"{PROJECT}\n#99999{PROJECT[3:]}"), "ifc", "2 IfcProject"),
    "no unit": ("a.ifc", lambda: FRAME.replace("((#1,#2,", "((#2,"), "ifc", "no length unit"),
    "no units": ("a.ifc", lambda: FRAME.replace("(#8),#10);", "(#8),$);"), "ifc", "no length unit"),
    "infinite": ("a.ifc", lambda: FRAME.replace(POINT, "IFCCARTESIANPOINT((6.2E699,0.2,0.))"), "ifc", "6.2E699"),
    "a unit of zero": ("a.ifc", lambda: length_unit("IFCLENGTHMEASURE(0.)"), "ifc", "LENGTHUNIT"),
    "a unit below zero": ("a.ifc", lambda: length_unit("IFCLENGTHMEASURE(-0.3)"), "ifc", "LENGTHUNIT"),
    "a unit without end": ("a.ifc", lambda: length_unit("IFCLENGTHMEASURE(1.E308)"), "ifc", "LENGTHUNIT"),
    "a unit of a text": ("a.ifc", lambda: length_unit("IFCTEXT('a')"), "ifc", "LENGTHUNIT"),
    "a unit of itself": ("a.ifc", lambda: length_unit("IFCLENGTHMEASURE(0.3)", "#1"), "ifc", "LENGTHUNIT"),
    "a mass unit of a text": ("a.ifc", lambda: kilogram("IFCTEXT('a')"), "ifc", "MASSUNIT"),
    "no coordinates": ("a.ifc", lambda: FRAME.replace(POINT, "IFCCARTESIANPOINT(())"), "ifc", "in line 43"),
    "one coordinate": ("a.ifc", lambda: FRAME.replace(POINT, "IFCCARTESIANPOINT((6.2))"), "ifc", "in line 43"),
    "no number": ("a.ifc", lambda: FRAME.replace(POINT, "IFCCARTESIANPOINT((NAN,0.2,0.))"), "ifc", "in line 43"),
    "parts of nothing": ("a.ifc", lambda: with_line("IFCRELAGGREGATES('0', $,$,$,$,(#31))"), "ifc", "#990=IfcRelAggr"),
    "id twice": ("a.ifc", lambda: FRAME.replace(POINT + ";", POINT + f";\n{line_of('IFCPROJECT(')}"), "ifc", "twice"),
    "hole": (
        "a.ifc",
        lambda: FRAME.replace("IFCCARTESIANPOINT((0.2,6.2", "IFCCARTESIANPOINT(((0.2,6.2"),
        "ifc",
        "damaged",
    ),
    "no data": ("a.ifc", lambda: FRAME.replace("DATA;", ""), "ifc", "no DATA section"),
    "no schema": ("a.ifc", lambda: FRAME.replace("FILE_SCHEMA", "FILE_NONE"), "ifc", "FILE_SCHEMA"),
    "old schema": (
        "a.ifc",
        lambda: FRAME.replace("'IFC4'", "'IFC2X_FINAL'").replace(POINT, "IFCCARTESIANPOINT()"),
        "ifc",
        "IFC2X_FINAL",
    ),
    "PDF": ("a.ifc", lambda: b"%PDF-1.7" + bytes(900), "ifc", "ISO-10303-21"),
    "no solid": ("a.ifc", lambda: FRAME.replace("IFCEXTRUDEDAREASOLID", "IFCPLANE"), "ifc", "nothing solid"),
    "two in a zip": ("a.ifczip", lambda: zipped("a.ifc", "b.ifc"), "ifc", "2 .ifc files"),
    "none in a zip": ("a.ifczip", lambda: zipped("a.txt"), "ifc", "0 .ifc files"),
    "damaged zip": ("a.ifczip", damaged_zip, "ifc", "zip archive"),
    "IFC named zip": ("a.ifczip", lambda: FRAME, "ifc", "zip archive"),
}
READ: dict[str, tuple[str, Callable[[], bytes | str], str]] = {
    "zip": ("a.ifczip", lambda: zipped("folder/A.IFC"), ""),
    "candidate": ("a.ifc", lambda: FRAME.replace("'IFC4'", "'IFC4RC4'"), "IFC4RC4 was read as IFC4"),
    "later name": ("a.ifc", lambda: FRAME.replace("'IFC4'", "'IFC4_ADD2_TC1'"), "IFC4_ADD2_TC1 was read as IFC4"),
    "Latin-1": ("a.ifc", lambda: FRAME.replace("'frame'", "'Träger'").encode("latin-1"), ""),
    "Windows path in the header": ("a.ifc", lambda: FRAME.replace("FILE_NAME('", r"FILE_NAME('C:\Users\new\\"), ""),
    "comments": (
        "a.ifc",
        lambda: FRAME.replace("HEADER;", "HEADER; /* it's */").replace("DATA;", "DATA; /* #1= */"),
        "",
    ),
    "cut encodings": ("a.ifc", lambda: FRAME.replace("'frame'", r"'\X2\4E0A\X0: \X2\\X0\ \X4\ \Q \'"), ""),
    "a density that is a text": ("a.ifc", lambda: FRAME.replace("IFCMASSDENSITYMEASURE(2400.)", "IFCLABEL('a')"), ""),
    "a set without a name": ("a.ifc", lambda: FRAME.replace("'Qto_BeamBaseQuantities',$,$,(", "$,$,$,("), ""),
    "feet": ("a.ifc", lambda: length_unit("IFCLENGTHMEASURE(0.3048)"), ""),
    "a point in a text": ("a.ifc", lambda: FRAME.replace("'frame'", "'IFCDIRECTION(x)'"), ""),
    "blanks in a point": ("a.ifc", lambda: FRAME.replace(POINT, "IfcCartesianPoint ( ( 6.2 ,\n0.2, 0. ) )"), ""),
    "byte order mark": ("a.ifc", lambda: b"\xef\xbb\xbf" + FRAME.encode(), ""),
    "Windows line ends": ("a.ifc", lambda: FRAME.replace("\n", "\r\n").encode(), ""),
    "one line": ("a.ifc", lambda: FRAME.replace("\n", ""), ""),
}


@pytest.fixture(autouse=True)
def in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def written(name: str, content: bytes | str) -> Path:
    path = Path(name)
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


@pytest.mark.parametrize("case", BAD)
def test_a_bad_file_is_refused(case: str, capsys: pytest.CaptureFixture[str]) -> None:
    name, content, code, said = BAD[case]
    path = written(name, content())
    assert run(["voxelize", str(path), "--voxel-size", "0.1", "-o", "grid.zarr.zip", "--json", "-q"]) == 2
    printed = capsys.readouterr()
    error = json.loads(printed.out)["error"]
    assert error["code"] == code
    assert said in error["message"]
    assert error["hint"]
    assert "Traceback" not in printed.err
    assert [item.name for item in Path().iterdir()] == [name]


def test_a_part_thousands_of_kilometres_away_is_left_out_by_name(capsys: pytest.CaptureFixture[str]) -> None:
    path = written("a.ifc", FRAME.replace(POINT, "IFCCARTESIANPOINT((6.2E6,0.2,0.))"))
    assert run(["voxelize", str(path), "--voxel-size", "0.2", "-o", "grid.zarr.zip", "--json", "-q"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert len(document["components"]) == 7
    assert [(one["name"], one["reason"]) for one in document["skipped"]] == [
        ("Column B1", "lies more than 1,000 km away")
    ]
    assert "Column B1" in " ".join(document["notes"])


@pytest.mark.parametrize("case", READ)
def test_an_odd_file_is_read(case: str, capsys: pytest.CaptureFixture[str]) -> None:
    name, content, note = READ[case]
    path = written(name, content())
    assert run(["voxelize", str(path), "--voxel-size", "0.2", "-o", "grid.zarr.zip", "--json", "-q"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert len(document["components"]) == 8
    assert note in " ".join(document["notes"])


@pytest.mark.parametrize("query", ["", "IfcWall,", "IfcWall, material=", "Ifc Wall", "ifcwall", "IfcWall, [", "=", "!"])
def test_a_bad_selection_names_the_selection_and_the_place(query: str, capsys: pytest.CaptureFixture[str]) -> None:
    path = written("a.ifc", FRAME)
    assert run(["voxelize", str(path), "--select", query, "--json", "-q"]) == 2
    error = json.loads(capsys.readouterr().out)["error"]
    assert error["code"] == "selection"
    assert error["message"].startswith(f"select {query!r}: ")
    assert "-1" not in error["message"]
    assert "IfcColumn" in error["hint"]
