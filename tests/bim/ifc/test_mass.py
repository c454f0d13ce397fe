"""Masses and materials that a file states, without geometry."""

from __future__ import annotations

import pytest

from bimvox.bim.ifc.mass import (
    DRAWN_SOLID,
    OVERFULL,
    VOLUME_REFUSED,
    VOLUME_SLIP,
    WEIGHT_DOUBTFUL,
    WEIGHT_ODD,
    WEIGHT_SLIP,
    Mass,
    Masses,
    weakest,
)
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


def test_net_weight_comes_before_gross_and_of_a_doubtful_weight_the_greater_one_counts() -> None:
    made = IfcMaker()
    beam = made.rooted("IfcBeam")
    made.properties(beam, "Qto", NetWeight=900.0, GrossWeight=1000.0)
    found = Masses(made.file, Properties())
    assert found.of(beam, 0.4, exact=True) == Mass(900.0, "quantity")
    heavy = Mass(900.0, "quantity", doubts=(WEIGHT_DOUBTFUL,), doubted_kg=(900.0, 2400.0 * 0.05))
    assert found.of(beam, 0.05, exact=True) == heavy
    light = Mass(2400.0 * 60.0, "default", doubts=(WEIGHT_DOUBTFUL,), doubted_kg=(900.0, 2400.0 * 60.0))
    assert found.of(beam, 60.0, exact=True) == light


@pytest.mark.parametrize(
    ("stated", "material", "kg", "doubts"),
    [
        (3.925, "S355", 3925.0, (WEIGHT_SLIP,)),
        (3.925e6, "S355", 3925.0, (WEIGHT_SLIP,)),
        (1.25, None, 1250.0, (WEIGHT_SLIP,)),
        (1250.0, "Concrete C30/37", 1250.0, ()),
        (1.25, "Concrete C30/37", 1250.0, (WEIGHT_SLIP,)),
        (1.2e6, "Concrete C30/37", 1250.0, (WEIGHT_SLIP,)),
        (40.0, "Concrete C30/37", 1250.0, (WEIGHT_DOUBTFUL,)),
        (249.0, "Concrete C30/37", 1250.0, (WEIGHT_DOUBTFUL,)),
        (251.0, "Concrete C30/37", 251.0, ()),
        (40.0, "S355", 3925.0, (WEIGHT_DOUBTFUL,)),
        (5_900.0, "Concrete C30/37", 5_900.0, ()),
        (11_000.0, "Concrete C30/37", 11_000.0, (WEIGHT_DOUBTFUL,)),
        (124_000.0, "Concrete C30/37", 124_000.0, (WEIGHT_DOUBTFUL,)),
        (1e6, "S355", 3925.0, (WEIGHT_DOUBTFUL,)),
        (-1250.0, "Concrete C30/37", 1250.0, (WEIGHT_DOUBTFUL,)),
        (0.0, "Concrete C30/37", 1250.0, ()),
        (8.0, "EPS", 8.0, (WEIGHT_ODD,)),
        (240.0, "Timber GL24h", 240.0, ()),
    ],
)
def test_of_a_stated_weight_that_the_material_contradicts_the_greater_one_counts(
    stated: float, material: str | None, kg: float, doubts: tuple[str, ...]
) -> None:
    made = IfcMaker()
    beam = made.rooted("IfcBeam")
    made.properties(beam, "Producer", Weight=stated)
    if material is not None:
        made.material(beam, material)
    mass = Masses(made.file, Properties()).of(beam, 0.5, exact=True)
    assert mass.kg == pytest.approx(kg)
    assert mass.doubts == doubts
    if WEIGHT_ODD in doubts or not doubts:
        assert mass.doubted_kg == ()
    else:
        assert mass.doubted_kg == (stated, pytest.approx(3925.0 if material == "S355" else 1250.0, rel=0.05))
        assert mass.kg >= mass.doubted_kg[1], "the greater one counts"


def test_a_body_drawn_twice_weighs_no_more_than_its_box() -> None:
    made = IfcMaker()
    found = Masses(made.file, Properties())
    slab = made.rooted("IfcSlab")
    assert found.of(slab, 2.0, exact=True, box_m3=1.0) == Mass(2400.0, "default", doubts=(OVERFULL,))
    assert found.of(slab, 1.0, exact=True, box_m3=1.0) == Mass(2400.0, "default")


def test_of_two_stated_weights_the_plausible_one_counts() -> None:
    made = IfcMaker()
    wall = made.rooted("IfcWall")
    made.material(wall, "Concrete")
    made.properties(wall, "Qto", NetWeight=2e7, GrossWeight=2600.0)
    assert Masses(made.file, Properties()).of(wall, 1.0, exact=True) == Mass(2600.0, "quantity")


@pytest.mark.parametrize(
    ("stated_m3", "used_m3", "doubts"),
    [
        (0.5, 0.5, ()),
        (1.9, 1.9, ()),
        (500.0, 0.5, (VOLUME_SLIP,)),
        (5e8, 0.5, (VOLUME_SLIP,)),
        (0.5e-3, 1.0, (VOLUME_REFUSED,)),
        (3.0, 1.0, (VOLUME_REFUSED,)),
        (5e-10, 1.0, (VOLUME_REFUSED,)),
    ],
)
def test_a_stated_volume_that_the_box_of_an_open_mesh_cannot_hold_gives_way_to_the_geometry(
    stated_m3: float, used_m3: float, doubts: tuple[str, ...]
) -> None:
    made = IfcMaker()
    wall = made.rooted("IfcWall")
    made.properties(wall, "Qto_WallBaseQuantities", NetVolume=stated_m3)
    mass = Masses(made.file, Properties()).of(wall, 1.0, exact=False, box_m3=2.0)
    assert mass.kg == pytest.approx(2400.0 * used_m3)
    assert (mass.guessed, mass.doubts) == (used_m3 == 1.0, doubts)


@pytest.mark.parametrize(("layers", "stated_m", "thick_m"), [(0.2, None, 0.2), (None, 0.012, 0.012), (None, 3.0, None)])
def test_a_sheet_is_as_thick_as_stated(layers: float | None, stated_m: float | None, thick_m: float | None) -> None:
    made = IfcMaker()
    wall = made.rooted("IfcWall")
    if layers is not None:
        layer = made.file.create_entity("IfcMaterialLayer", made.file.create_entity("IfcMaterial", Name="XYZ"), layers)
        layer_set = made.file.create_entity("IfcMaterialLayerSet", [layer])
        made.rooted("IfcRelAssociatesMaterial", RelatedObjects=[wall], RelatingMaterial=layer_set)
    if stated_m is not None:
        made.properties(wall, "Qto_WallBaseQuantities", Width=stated_m)
    mass = Masses(made.file, Properties()).of(wall, 0.12, exact=False, box_m3=0.6, sheet_m2=12.0)
    assert mass.kg == pytest.approx(2400.0 * 12.0 * (thick_m or 0.01))
    assert mass.guessed == (thick_m is None)


@pytest.mark.parametrize(
    ("key", "value", "kg", "source"),
    [
        ("NetVolume", 2.4, 6000.0, "density"),
        ("NetVolume", 2.4e9, 6000.0, "density"),
        ("NetWeight", 6000.0, 6000.0, "quantity"),
        ("NetWeight", 1e6, 300.0, "density"),
        ("NetVolume", 20.0, 300.0, "density"),
    ],
)
def test_a_surface_may_stand_for_a_wall_as_thick_as_walls_are(key: str, value: float, kg: float, source: str) -> None:
    made = IfcMaker()
    wall = made.rooted("IfcWall")
    made.material(wall, "Concrete")
    made.properties(wall, "Qto_WallBaseQuantities", **{key: value})
    mass = Masses(made.file, Properties()).of(wall, 0.12, exact=False, box_m3=0.6, sheet_m2=12.0)
    assert mass.kg == pytest.approx(kg)
    assert mass.source == source


@pytest.mark.parametrize(
    ("stated_kg", "expected"),
    [
        (900.0, Mass(900.0, "quantity")),
        (3.0, Mass(3000.0, "quantity", doubts=(WEIGHT_SLIP,), doubted_kg=(3.0, 2400.0))),
        (9e6, Mass(2400.0, "default", True, (WEIGHT_DOUBTFUL,), (9e6, 2400.0))),
        (1e-3, Mass(2400.0, "default", True, (WEIGHT_DOUBTFUL,), (1e-3, 2400.0))),
    ],
)
def test_a_stated_weight_that_the_box_of_an_open_mesh_cannot_hold_gives_way_too(
    stated_kg: float, expected: Mass
) -> None:
    made = IfcMaker()
    wall = made.rooted("IfcWall")
    made.properties(wall, "Qto_WallBaseQuantities", NetWeight=stated_kg)
    mass = Masses(made.file, Properties()).of(wall, 1.0, exact=False, box_m3=2.0)
    assert mass == expected


@pytest.mark.parametrize(
    ("material", "stated", "kg_m3"),
    [
        ("S355", 7.85, 7850.0),
        ("XYZ", 2.4, 2400.0),
        ("Air", 1.2, None),
        ("S355", 7900.0, 7900.0),
        ("C30/37", 0.0, 2500.0),
    ],
)
def test_a_density_in_tonnes_is_recognised(material: str, stated: float, kg_m3: float | None) -> None:
    made = IfcMaker()
    beam = made.rooted("IfcBeam")
    value = made.file.create_entity("IfcMassDensityMeasure", stated)
    entry = made.file.create_entity("IfcPropertySingleValue", Name="MassDensity", NominalValue=value)
    made_of = made.file.create_entity("IfcMaterial", Name=material)
    made.file.create_entity("IfcMaterialProperties", Name="Pset_MaterialCommon", Properties=[entry], Material=made_of)
    made.rooted("IfcRelAssociatesMaterial", RelatedObjects=[beam], RelatingMaterial=made_of)
    mass = Masses(made.file, Properties()).of(beam, 1.0, exact=True)
    assert mass.kg == pytest.approx(1.2 if kg_m3 is None else kg_m3)


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


def test_what_is_drawn_solid_weighs_as_such_parts_do_unless_its_weight_or_its_volume_is_stated() -> None:
    made = IfcMaker()
    plank = made.rooted("IfcSlab")
    found = Masses(made.file, Properties(), solid_share=lambda _, m3, *__: 0.65 if m3 > 1.5 else None)
    solid = found.of(plank, 2.0, exact=True)
    assert solid == Mass(0.65 * 2400.0 * 2.0, "default", doubts=(DRAWN_SOLID,))
    made.material(plank, "C45/55")
    assert found.of(plank, 2.0, exact=True).source == "default", "it is an assumption"
    assert found.of(plank, 1.1, exact=True) == Mass(2500.0 * 1.1, "density")
    made.properties(plank, "Qto", NetVolume=1.9)
    assert _fresh(found, made).of(plank, 2.0, exact=True).doubts == (DRAWN_SOLID,), "that of the block"
    made.properties(plank, "Qto_More", GrossVolume=1.2)
    assert _fresh(found, made).of(plank, 2.0, exact=True) == Mass(2500.0 * 1.2, "density")
    made.properties(plank, "Qto_Weights", NetWeight=3300.0)
    assert _fresh(found, made).of(plank, 2.0, exact=True) == Mass(3300.0, "quantity")


def _fresh(masses: Masses, made: IfcMaker) -> Masses:
    """Return masses that look the properties up anew."""
    return Masses(made.file, Properties(), solid_share=masses._solid_share)
