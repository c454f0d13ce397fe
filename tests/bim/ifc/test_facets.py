"""Comparisons of a selection: each selects what it says, and its negation selects all others of the class."""

from __future__ import annotations

from typing import Any

import pytest

from bimvox.bim.ifc.select import select_products
from bimvox.errors import SelectionError

from ..conftest import IfcMaker

Model = tuple[Any, dict[str, int]]


@pytest.fixture(scope="module", params=["IFC2X3", "IFC4"])
def model(request: pytest.FixtureRequest) -> Model:
    """Three beams, B0 with every kind of statement, B1 with other ones, B2 with none; and a slab."""
    made = IfcMaker(request.param)
    beams = [made.box("IfcBeam", Name=f"B{index}") for index in range(3)]
    slab = made.box("IfcSlab", Name="S")
    for index, beam in enumerate(beams[:2]):
        made.material(beam, ("C50/60", "GL24h")[index])
        made.properties(beam, "Made", Maker=("North", "South")[index], Length=(5.0, 7.5)[index])
        made.rooted(
            "IfcRelDefinesByType",
            RelatedObjects=[beam],
            RelatingType=made.rooted("IfcBeamType", Name=("Long", "Short")[index], PredefinedType="BEAM"),
        )
        code = {"ItemReference" if request.param == "IFC2X3" else "Identification": ("21.1", "21.2")[index]}
        reference = made.file.create_entity("IfcClassificationReference", Name=("Frame", "Roof")[index], **code)
        made.rooted("IfcRelAssociatesClassification", RelatedObjects=[beam], RelatingClassification=reference)
        made.rooted(
            "IfcRelAssignsToGroup",
            RelatedObjects=[beam],
            RelatingGroup=made.rooted("IfcGroup", Name=("Phase 1", "Phase 2")[index]),
        )
        beam.Tag = ("T1", "T2")[index]
    upper = made.rooted("IfcBuildingStorey", Name="Level 2")
    made.aggregate(made.project, [upper])
    for relation in made.file.by_type("IfcRelContainedInSpatialStructure"):
        if beams[1] in relation.RelatedElements:
            relation.RelatingStructure = upper
        if beams[2] in relation.RelatedElements:
            made.file.remove(relation)
    return made.file, {product.Name: product.id() for product in (*beams, slab)}


def selected(model: Model, query: str) -> list[str]:
    file, ids = model
    found = select_products(file, query)
    return [name for name, step_id in ids.items() if step_id in found]


@pytest.mark.parametrize(
    ("facet", "value", "pattern", "part"),
    [
        ("material", '"C50/60"', "/C5.*/", "50/"),
        ("type", "Long", "/L/", "on"),
        ("location", '"Level 1"', "/Level 1/", "el 1"),
        ("parent", '"Level 1"', "/Level 1/", "el 1"),
        ("classification", "Frame", "/F/", "ram"),
        ("classification", '"21.1"', r"/21\.1/", '"1.1"'),
        ("group", '"Phase 1"', "/.* 1/", '"e 1"'),
        ("Tag", "T1", "/.1/", "1"),
        ("Made.Maker", "North", "/N/", "ort"),
        ("/Ma/.Maker", "North", "/N/", "ort"),
        ("Made./Mak.*/", "North", "/N/", "ort"),
        ("Made.Length", "5.0", "/5/", None),
        ('query:"Made.Maker"', "North", "/N/", "ort"),
        ('query:"type.Name"', "Long", "/L/", "on"),
        ('query:"materials.Name"', '"C50/60"', "/C5/", "50"),
    ],
)
def test_each_comparison_and_its_negation(model: Model, facet: str, value: str, pattern: str, part: str | None) -> None:
    quoted = part and (part if part.startswith('"') else f'"{part}"')
    assert selected(model, f"IfcBeam, {facet}={value}") == ["B0"]
    assert selected(model, f"IfcBeam, {facet}!={value}") == ["B1", "B2"]
    assert selected(model, f"IfcBeam, {facet}={pattern}") == ["B0"]
    assert selected(model, f"IfcBeam, {facet}!={pattern}") == ["B1", "B2"]
    assert selected(model, f"IfcBeam, {facet}=NULL") == ["B2"]
    assert selected(model, f"IfcBeam, {facet}!=NULL") == ["B0", "B1"]
    if quoted:
        assert selected(model, f"IfcBeam, {facet}*={quoted}") == ["B0"]
        assert selected(model, f"IfcBeam, {facet}!*={quoted}") == ["B1", "B2"]


def test_groups_of_facets_are_joined_and_each_begins_anew(model: Model) -> None:
    assert selected(model, 'IfcSlab + IfcBeam, material!="C50/60"') == ["B1", "B2", "S"]
    assert selected(model, 'IfcBeam, material!="C50/60", Tag!=T2 + IfcSlab') == ["B2", "S"]
    assert selected(model, "IfcElement, !IfcSlab") == ["B0", "B1", "B2"]
    assert selected(model, "!IfcSlab, Tag!=NULL") == ["B0", "B1"]
    assert selected(model, "material!=NULL + IfcSlab") == ["B0", "B1", "S"]


def test_order_is_between_numbers(model: Model) -> None:
    assert selected(model, "IfcBeam, Made.Length>5") == ["B1"]
    assert selected(model, "IfcBeam, Made.Length>=5") == ["B0", "B1"]
    assert selected(model, "IfcBeam, Made.Length<6.5") == ["B0"]
    with pytest.raises(SelectionError, match="matches no product"):
        selected(model, "IfcBeam, Made.Maker>North")


@pytest.mark.parametrize("query", ["IfcBeam, material*=NULL", "IfcBeam, Made.Length>TRUE", "IfcBeam, Tag*=/1/"])
def test_a_comparison_without_a_meaning_is_refused_in_words(model: Model, query: str) -> None:
    with pytest.raises(SelectionError, match="are compared with = or !="):
        selected(model, query)


def test_an_attribute_that_no_class_has_is_refused_as_it_would_select_everything(model: Model) -> None:
    with pytest.raises(SelectionError, match="has no attribute Nam") as caught:
        selected(model, "IfcBeam, Nam!=B1")
    assert "Name" in (caught.value.hint or "")


def test_a_path_without_quotes_is_refused_as_it_would_be_read_as_a_property_set(model: Model) -> None:
    with pytest.raises(SelectionError, match="needs quotes"):
        selected(model, "IfcBeam, query:Made.Maker!=North")


def test_a_whole_that_states_no_material_has_those_of_its_parts(maker: type[IfcMaker]) -> None:
    made = maker()
    parts = [made.box("IfcBeam", Name=f"B{index}") for index in range(2)]
    made.material(parts[0], "Steel")
    wholes = [made.rooted("IfcElementAssembly", Name=f"A{index}") for index in range(2)]
    for whole, part in zip(wholes, parts, strict=True):
        made.aggregate(whole, [part])
    model = made.file, {one.Name: one.id() for one in (*parts, *wholes)}
    assert selected(model, "IfcElement, material!=Steel") == ["B1", "A1"]
    assert selected(model, "IfcElement, material=NULL") == ["B1", "A1"]
    assert selected(model, "IfcElement, parent=A0") == ["B0", "A0"]
    assert selected(model, "IfcElement, parent!=A0") == ["B1", "A1"]


def test_layers_without_a_material_and_wholes_in_a_circle(maker: type[IfcMaker]) -> None:
    made = maker()
    wall = made.box("IfcWall", Name="W")
    steel = made.file.create_entity("IfcMaterial", Name="Steel")
    layers = [
        made.file.create_entity("IfcMaterialLayer", Material=material, LayerThickness=0.1) for material in (None, steel)
    ]
    made.rooted(
        "IfcRelAssociatesMaterial",
        RelatedObjects=[wall],
        RelatingMaterial=made.file.create_entity("IfcMaterialLayerSet", MaterialLayers=layers),
    )
    wholes = [made.rooted("IfcElementAssembly", Name=f"A{index}") for index in range(2)]
    made.aggregate(wholes[0], wholes[1:])
    made.aggregate(wholes[1], wholes[:1])
    model = made.file, {one.Name: one.id() for one in (wall, *wholes)}
    assert selected(model, "IfcElement, material!=Timber") == ["W", "A0", "A1"]
    assert selected(model, "IfcElement, material=Steel") == ["W"]
    assert selected(model, "IfcElement, parent=A0") == ["A0", "A1"]
    assert selected(model, "IfcElement, parent!=A0") == ["W"]
