"""Values in units of their own."""

from __future__ import annotations

from typing import Any

import pytest

from bimvox.bim.ifc.mass import Masses
from bimvox.bim.ifc.properties import Properties, Stated
from bimvox.bim.ifc.units import Units

from ..conftest import IfcMaker

KIP_KG = 453.59237


def si(made: IfcMaker, kind: str, name: str, prefix: str | None = None) -> Any:
    unit = made.file.create_entity("IfcSIUnit", UnitType=kind, Name=name)
    unit.Prefix = prefix
    return unit


def converted(made: IfcMaker, kind: str, name: str, factor: float, measure: str, base: Any) -> Any:
    none = made.file.create_entity("IfcDimensionalExponents", 0, 1, 0, 0, 0, 0, 0)
    ratio = made.file.create_entity("IfcMeasureWithUnit", made.file.create_entity(measure, factor), base)
    return made.file.create_entity("IfcConversionBasedUnit", none, kind, name, ratio)


def unit_of(made: IfcMaker, which: str) -> Any:
    kg, newton = si(made, "MASSUNIT", "GRAM", "KILO"), si(made, "FORCEUNIT", "NEWTON")
    return {
        "none": None,
        "kg": kg,
        "g": si(made, "MASSUNIT", "GRAM"),
        "Mg": si(made, "MASSUNIT", "GRAM", "MEGA"),
        "tonne": converted(made, "MASSUNIT", "tonne", 1000.0, "IfcMassMeasure", kg),
        "kip": converted(made, "MASSUNIT", "kip", KIP_KG, "IfcMassMeasure", kg),
        "kip of force": converted(made, "FORCEUNIT", "kip", 4448.2216152605, "IfcForceMeasure", newton),
        "kN": si(made, "FORCEUNIT", "NEWTON", "KILO"),
        "t by name": made.file.create_entity("IfcContextDependentUnit", None, "MASSUNIT", "t"),
        "loop": converted(made, "MASSUNIT", "mad", 0.0, "IfcMassMeasure", kg),
    }[which]


@pytest.mark.parametrize("as_quantity", [True, False])
@pytest.mark.parametrize(
    ("which", "value"),
    [
        ("none", 3925.0),
        ("kg", 3925.0),
        ("g", 3.925e6),
        ("Mg", 3.925),
        ("tonne", 3.925),
        ("kip", 3925.0 / KIP_KG),
        ("kip of force", 3925.0 / KIP_KG),
        ("kN", 3.925 * 9.80665),
        ("t by name", 3.925),
    ],
)
def test_a_weight_has_its_own_unit(which: str, value: float, as_quantity: bool) -> None:
    made = IfcMaker()
    post = made.rooted("IfcColumn")
    unit = unit_of(made, which)
    if as_quantity:
        entry = made.file.create_entity("IfcQuantityWeight", Name="NetWeight", Unit=unit, WeightValue=value)
        definition = made.rooted("IfcElementQuantity", Name="Qto", Quantities=[entry])
    else:
        measure = "IfcForceMeasure" if which in ("kN", "kip of force") else "IfcMassMeasure"
        stated = made.file.create_entity(measure, value)
        entry = made.file.create_entity("IfcPropertySingleValue", Name="Weight", NominalValue=stated, Unit=unit)
        definition = made.rooted("IfcPropertySet", Name="Producer", HasProperties=[entry])
    made.rooted("IfcRelDefinesByProperties", RelatedObjects=[post], RelatingPropertyDefinition=definition)
    mass = Masses(made.file, Properties()).of(post, 0.5, exact=True)
    assert mass.kg == pytest.approx(3925.0)
    assert mass.source == "quantity"
    assert not mass.doubts


def test_a_value_of_another_measure_is_no_weight() -> None:
    made = IfcMaker()
    units = Units(made.file)
    assert units.kg(Stated(3.0, "IfcMassDensityMeasure")) is None
    assert units.kg(Stated(3.0, "IfcLengthMeasure")) is None
    assert units.kg(Stated(3.0, "IfcMassMeasure", unit_of(made, "loop"))) is None
    assert units.kg(Stated(3.0, "IfcMassMeasure", made.file.by_type("IfcSIUnit")[0])) is None
    assert units.m3(Stated(3.0, "IfcAreaMeasure")) is None
    assert units.kg_m3(Stated(3.0, "IfcMassMeasure")) is None


def test_a_volume_and_a_density_have_their_own_units() -> None:
    made = IfcMaker()
    units = Units(made.file)
    cube = si(made, "VOLUMEUNIT", "CUBIC_METRE", "MILLI")
    assert units.m3(Stated(2.5e9, "IfcQuantityVolume", cube)) == pytest.approx(2.5)
    assert units.m3(Stated(2.5, "IfcVolumeMeasure")) == 2.5
    elements = [
        made.file.create_entity("IfcDerivedUnitElement", si(made, "MASSUNIT", "GRAM", "MEGA"), 1),
        made.file.create_entity("IfcDerivedUnitElement", si(made, "LENGTHUNIT", "METRE"), -3),
    ]
    per_m3 = made.file.create_entity("IfcDerivedUnit", elements, "MASSDENSITYUNIT")
    assert units.kg_m3(Stated(7.85, "IfcMassDensityMeasure", per_m3)) == pytest.approx(7850.0)
    assert units.kg_m3(Stated(7850.0, "IfcMassDensityMeasure")) == 7850.0


def test_the_project_has_the_unit_if_a_value_has_none() -> None:
    made = IfcMaker()
    assignment = made.project.UnitsInContext
    assignment.Units = [*assignment.Units, unit_of(made, "kip"), unit_of(made, "kN")]
    units = Units(made.file)
    assert units.kg(Stated(2.0, "IfcQuantityWeight")) == pytest.approx(2.0 * KIP_KG)
    assert units.kg(Stated(2.0)) == pytest.approx(2.0 * KIP_KG)
    assert units.kg(Stated(9.80665, "IfcForceMeasure")) == pytest.approx(1000.0)
