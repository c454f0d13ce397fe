"""An asterisk for an empty value is read as one; an asterisk for a derived value stays."""

from __future__ import annotations

from pathlib import Path

import pytest

from bimvox.bim.ifc.text import without_stars
from bimvox.bim.read import read_building

from ..conftest import IfcMaker


@pytest.mark.parametrize(
    ("instance", "read"),
    [
        ("#1=IFCWALL('g',*,*,$,*,#2,#3,*,.SOLIDWALL.);", "#1=IFCWALL('g',$,$,$,$,#2,#3,$,.SOLIDWALL.);"),
        ("#1= IFCPRODUCTDEFINITIONSHAPE(* , *,(#2,#3));", "#1= IFCPRODUCTDEFINITIONSHAPE($ , $,(#2,#3));"),
        ("#1=IFCRECTANGLEPROFILEDEF(.AREA.,*,#2,1.,2.);", "#1=IFCRECTANGLEPROFILEDEF(.AREA.,$,#2,1.,2.);"),
        ("#1=IfcQuantityLength('a=b,(;',*,\n*,3.);", "#1=IfcQuantityLength('a=b,(;',$,\n$,3.);"),
        ("#1=IFCRELAGGREGATES('g',#2,*,*,#3,(#4,#5));", "#1=IFCRELAGGREGATES('g',#2,$,$,#3,(#4,#5));"),
        (
            "#1=IFCPROPERTYSINGLEVALUE('it''s',*,IFCLABEL('x'),*);",
            "#1=IFCPROPERTYSINGLEVALUE('it''s',$,IFCLABEL('x'),$);",
        ),
    ],
)
def test_what_the_schema_does_not_derive_is_empty(instance: str, read: str) -> None:
    found, notes = without_stars(instance, "IFC2X3")
    assert found == read
    assert notes[0].split(": ")[1].startswith(str(instance.count("*")))


@pytest.mark.parametrize(
    "instance",
    [
        "#7=IFCSIUNIT(*,.LENGTHUNIT.,.MILLI.,.METRE.);",
        "#15=IFCGEOMETRICREPRESENTATIONSUBCONTEXT('Body','Model',*,*,*,*,#14,$,.MODEL_VIEW.,$);",
        "#3=IFCORIENTEDEDGE(*,*,#1,.T.);",
        "#3=IFCWALL('g',#2,'a(*,*)',$,$,#2,#3,'(*,');",
        "#3=IFCNOSUCHCLASS(*,$);",
        "(*,*)",
    ],
)
def test_what_it_derives_stays_and_so_do_texts_and_what_is_unknown(instance: str) -> None:
    assert without_stars(instance, "IFC2X3") == (instance, [])


def test_parts_with_asterisks_keep_their_bodies(maker: type[IfcMaker], tmp_path: Path) -> None:
    made = maker("IFC2X3")
    for index, ifc_class in enumerate(("IfcColumn", "IfcBeam", "IfcSlab")):
        made.box(ifc_class, (3.0 * index, 0.0, 0.0), (1.0, 1.0, 2.0))
    path = made.write(tmp_path / "a.ifc")
    sound = read_building(path)
    path.write_text(path.read_text().replace(",$", ",*").replace("($", "(*"))
    building = read_building(path)
    assert [(one.name, one.mass_kg) for one in building.elements] == [(one.name, one.mass_kg) for one in sound.elements]
    assert len(building.elements) == 3
    assert [note for note in building.notes if "written as *" in note]
    assert not [note for note in building.notes if "left out" in note]


@pytest.mark.parametrize("hostile", ["(*," * 300_000, "#1=IFCWALL(" + "*," * 300_000, "#1=IFCWALL((" + "*," * 300_000])
def test_very_many_asterisks_take_no_longer_than_their_number(hostile: str) -> None:
    without_stars(hostile, "IFC4")
