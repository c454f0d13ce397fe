"""Files of IFC2X3 as IFC4: what becomes of materials, dates, owners, and of classes that IFC4 does not have."""

from pathlib import Path

import ifcopenshell
import pytest
from valid_ifc import issues

from bimvox.errors import IfcError
from bimvox.exporters.ifc4 import as_ifc4

MODEL = Path(__file__).parents[2] / "sample_models" / "frame_ifc2x3_mm.ifc"


def made_of(file):
    notes = []
    made, step_ids = as_ifc4(MODEL, file, notes.append)
    return made, step_ids, notes


def test_every_entity_is_there_and_densities_are_property_sets():
    old = ifcopenshell.open(MODEL)
    before = {one.id(): one.is_a() for one in old}
    density = old.by_type("IfcGeneralMaterialProperties")[0].MassDensity
    made, step_ids, notes = made_of(old)
    assert made.schema == "IFC4"
    assert issues(made) == []
    lost = [name for number, name in before.items() if number not in step_ids]
    assert set(lost) == {"IfcGeneralMaterialProperties"}
    assert {made.by_id(step_ids[number]).is_a() for number in step_ids} == set(before.values()) - set(lost)
    (stated,) = {
        (one.Name, value.Name, value.NominalValue.is_a(), value.NominalValue.wrappedValue)
        for one in made.by_type("IfcMaterialProperties")
        for value in one.Properties
    }
    assert stated == ("Pset_MaterialCommon", "MassDensity", "IfcMassDensityMeasure", density)
    assert notes == [f"{MODEL.name} is IFC2X3, whose dates no current program reads: written as IFC4"]


def test_what_ifc4_does_not_have_is_left_out_and_named_and_the_rest_goes_on():
    old = ifcopenshell.open(MODEL)
    symbol = old.create_entity("IfcDefinedSymbol")
    old.create_entity("IfcGeometricSet", [old.by_type("IfcCartesianPoint")[0], symbol])
    old.create_entity("IfcLocalTime", 12)
    day = old.create_entity("IfcCalendarDate", 7, 3, 2011)
    old.create_entity("IfcClassification", "a", "b", day, "c")
    made, _, notes = made_of(old)
    (points,) = made.by_type("IfcGeometricSet")
    assert [one.is_a() for one in points.Elements] == ["IfcCartesianPoint"]
    assert made.by_type("IfcClassification")[0].EditionDate == "2011-3-7"
    assert notes[1:] == ["IFC4 has no such class, left out: 1 IfcDefinedSymbol, 1 IfcLocalTime"]


def test_an_entity_that_cannot_be_written_is_named(monkeypatch):
    def fails(*_):
        raise NotImplementedError("no equivalent")

    monkeypatch.setattr("bimvox.exporters.ifc4.Migrator.migrate_attributes", fails)
    with pytest.raises(IfcError, match=r"#\d+ Ifc\w+ cannot be written as IFC4: no equivalent"):
        made_of(ifcopenshell.open(MODEL))
