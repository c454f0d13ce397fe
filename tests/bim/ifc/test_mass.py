"""Masses and materials that a file states, without geometry."""

from __future__ import annotations

import pytest

from bimvox.bim.ifc.mass import Mass, Masses, weakest
from bimvox.bim.ifc.properties import Properties

from ..conftest import IfcMaker


def test_layers_count_by_their_thickness() -> None:
    made = IfcMaker()
    wall = made.rooted("IfcWall")
    layers = [
        made.file.create_entity("IfcMaterialLayer", made.file.create_entity("IfcMaterial", Name=name), thickness)
        for name, thickness in (("Concrete", 0.2), ("EPS insulation", 0.1), ("Mystery", 0.7), (" ", 0.9))
    ]
    layer_set = made.file.create_entity("IfcMaterialLayerSet", layers)
    made.rooted("IfcRelAssociatesMaterial", RelatedObjects=[wall], RelatingMaterial=layer_set)
    found = Masses(made.file, Properties())
    mass = found.of(wall, 2.0, exact=True)
    assert mass.kg == pytest.approx(2.0 * (2500 * 0.2 + 40 * 0.1) / 0.3)
    assert mass.source == "density"
    assert Properties().material(wall) == "Mystery"


def test_a_stated_density_beats_the_name_and_a_stated_volume_an_open_mesh() -> None:
    made = IfcMaker()
    beam = made.rooted("IfcBeam")
    steel = made.file.create_entity("IfcMaterial", Name="Steel")
    density = made.file.create_entity(
        "IfcPropertySingleValue",
        Name="MassDensity",
        NominalValue=made.file.create_entity("IfcMassDensityMeasure", 8000.0),
    )
    made.file.create_entity("IfcMaterialProperties", Name="Pset_MaterialCommon", Properties=[density], Material=steel)
    made.rooted("IfcRelAssociatesMaterial", RelatedObjects=[beam], RelatingMaterial=steel)
    made.properties(beam, "Qto_BeamBaseQuantities", NetVolume=0.5)
    found = Masses(made.file, Properties())
    assert found.of(beam, 2.0, exact=True).kg == pytest.approx(16_000)
    assert found.of(beam, 2.0, exact=False).kg == pytest.approx(4_000)


def test_net_weight_comes_before_gross_and_absurd_weights_are_refused() -> None:
    made = IfcMaker()
    beam = made.rooted("IfcBeam")
    made.properties(beam, "Qto", NetWeight=900.0, GrossWeight=1000.0)
    found = Masses(made.file, Properties())
    assert found.of(beam, 0.4, exact=True).kg == 900.0
    assert not found.of(beam, 0.4, exact=True).stated_odd
    assert found.of(beam, 0.05, exact=True).stated_odd
    assert found.of(beam, 60.0, exact=True) == Mass(900.0, "quantity", stated_odd=True)
    absurd = found.of(beam, 400.0, exact=True)
    assert (absurd.source, absurd.stated_refused) == ("default", True)


@pytest.mark.parametrize("stated_m3", [0.5, 1.9, 500.0, 0.5e-3, 5e8, 5e-10])
def test_a_stated_volume_that_the_box_of_an_open_mesh_cannot_hold_gives_way_to_the_geometry(stated_m3: float) -> None:
    made = IfcMaker()
    wall = made.rooted("IfcWall")
    made.properties(wall, "Qto_WallBaseQuantities", NetVolume=stated_m3)
    mass = Masses(made.file, Properties()).of(wall, 1.0, exact=False, box_m3=2.0)
    fits = 0.01 < stated_m3 < 2.0
    assert mass == Mass(2400.0 * (stated_m3 if fits else 1.0), "default", volume_refused=not fits)


@pytest.mark.parametrize("stated_kg", [3.0, 900.0, 9e6, 1e-3])
def test_a_stated_weight_that_the_box_of_an_open_mesh_cannot_hold_gives_way_too(stated_kg: float) -> None:
    made = IfcMaker()
    wall = made.rooted("IfcWall")
    made.properties(wall, "Qto_WallBaseQuantities", NetWeight=stated_kg)
    mass = Masses(made.file, Properties()).of(wall, 1.0, exact=False, box_m3=2.0)
    fits = 1.0 < stated_kg < 1e4
    assert mass == Mass(stated_kg, "quantity") if fits else mass == Mass(2400.0, "default", stated_refused=True)


def test_the_weakest_source() -> None:
    assert weakest(["quantity", "default", "density"]) == "default"
    assert weakest(["quantity"]) == "quantity"


@pytest.mark.parametrize(
    ("key", "used"),
    [("Weight", True), ("Net weight", True), ("GEWICHT", True), ("Net_Weight", True), ("Weight per metre", False)],
)
def test_weights_by_the_keys_of_several_programs(key: str, used: bool) -> None:
    made = IfcMaker()
    beam = made.rooted("IfcBeam")
    made.properties(beam, "Tekla Quantity", **{key: 1200.0})
    assert (Masses(made.file, Properties()).of(beam, 0.5, exact=True).source == "quantity") is used
