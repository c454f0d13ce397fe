"""The kind of a part, by the strongest evidence."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from bimvox.bim.building import Casting, TriangleMesh
from bimvox.bim.kinds.evidence import Facts, judge
from bimvox.bim.kinds.kind import Confidence, Kind


def box(x_m: float, y_m: float, z_m: float, tilt_rad: float = 0.0) -> TriangleMesh:
    made = trimesh.creation.box((x_m, y_m, z_m))
    if tilt_rad:
        made.apply_transform(trimesh.transformations.rotation_matrix(tilt_rad, (0, 1, 0)))
    return TriangleMesh(np.array(made.vertices), np.array(made.faces, np.int32))


WALL = Facts("IfcWall", ("Wall-1", "Basic Wall", None), (), box(6.0, 0.3, 3.0))


def kind_of(facts: Facts = WALL, **changes: object) -> tuple[Kind, Confidence]:
    judgement, _ = judge(replace(facts, **changes))  # type: ignore[arg-type]
    return judgement.kind, judgement.confidence


def test_of_a_part_of_which_nothing_is_said_nothing_is_known() -> None:
    judgement, casting = judge(WALL)
    assert (judgement.kind, judgement.confidence, casting) == (Kind.OTHER, Confidence.ASSUMED, None)
    assert judgement.why == "nothing says what it is made of"


def test_a_classification_comes_before_the_material_and_the_material_before_the_name() -> None:
    named = {"names": ("Interior - Partition", None, None)}
    assert kind_of(**named) == (Kind.LIGHT, Confidence.ASSUMED)
    made_of = {**named, "layers": [("Kalksandstein", 0.2)]}
    assert kind_of(**made_of) == (Kind.MASONRY, Confidence.NAMED)
    assert kind_of(**made_of, classes=["Timber framed wall systems"]) == (Kind.TIMBER, Confidence.STATED)


def test_of_layers_the_kind_that_weighs_most_decides() -> None:
    cavity = [("Brick, Common", 0.102), ("Fiberglass Batt", 0.075), ("Concrete Masonry Units", 0.1), ("Plaster", 0.012)]
    assert kind_of(layers=cavity)[0] is Kind.MASONRY
    assert (
        kind_of(layers=[("Plasterboard", 0.0125), ("Metal Stud Layer", 0.07), ("Plasterboard", 0.0125)])[0]
        is Kind.LIGHT
    )
    assert kind_of(layers=[("EPS", 0.2), ("Beton C30/37", 0.2), ("Estrich", 0.05)])[0] is Kind.CONCRETE
    assert kind_of(layers=[("Unnamed", 0.2), ("", 0.1)])[0] is Kind.OTHER


def test_what_is_cast_where() -> None:
    concrete = [("Concrete C30/37", 1.0)]
    assert judge(replace(WALL, layers=concrete))[1] is None
    judgement, casting = judge(replace(WALL, layers=concrete, casting=Casting.PRECAST))
    assert (judgement.kind, judgement.confidence, casting) == (Kind.PRECAST, Confidence.STATED, Casting.PRECAST)
    assert judgement.why == "its properties state that it is precast"
    judgement, casting = judge(replace(WALL, layers=[("02 Beton gewapend - prefab", 1.0)]))
    assert (judgement.kind, judgement.confidence, casting) == (Kind.PRECAST, Confidence.NAMED, Casting.PRECAST)
    assert judgement.why == "'02 Beton gewapend - prefab' says that it is precast"
    judgement, casting = judge(replace(WALL, names=("vloer", "betonvloer breedplaat 60, ihw", None)))
    assert (judgement.kind, casting) == (Kind.CONCRETE, Casting.IN_SITU)
    assert kind_of(layers=[("Stahl S355", 1.0)], casting=Casting.PRECAST)[0] is Kind.STEEL
    assert kind_of(layers=[("Brick", 1.0)], casting=Casting.PRECAST)[0] is Kind.PRECAST


def test_formwork_is_what_is_called_so_whatever_it_is_made_of() -> None:
    assert kind_of(names=("BEKISTING", "PL18*800", None), layers=[("TIMBER/HOUT", 1.0)])[0] is Kind.FORMWORK
    assert kind_of(names=("Wall", None, "Formwork panel"), casting=Casting.PRECAST)[0] is Kind.FORMWORK


def test_a_footing_is_cast_in_place_unless_it_is_precast() -> None:
    beam = replace(WALL, ifc_class="IfcBeam", names=("FUND", "PL800*2000", None), layers=[("CONCRETE/BETON", 1.0)])
    judgement, casting = judge(beam)
    assert (judgement.kind, casting) == (Kind.CONCRETE, Casting.IN_SITU)
    assert judgement.why == "'fund' in its name says that it is a footing"
    assert judge(replace(beam, casting=Casting.PRECAST))[0].kind is Kind.PRECAST
    assert judge(replace(beam, layers=[("Steel", 1.0)]))[1] is None


def test_floors_of_hollow_blocks_are_made_in_place() -> None:
    floor = replace(WALL, ifc_class="IfcSlab", names=("Solaio", "Latero Cementizio - 30 cm", None))
    judgement, casting = judge(replace(floor, layers=[("Laterizio", 0.2), ("Calcestruzzo", 0.05)]))
    assert (judgement.kind, casting) == (Kind.CONCRETE, Casting.IN_SITU)


def test_predefined_type_and_class() -> None:
    assert kind_of(predefined_type="PARTITIONING") == (Kind.LIGHT, Confidence.NAMED)
    assert kind_of(ifc_class="IfcWallStandardCase", predefined_type="PARTITIONING")[0] is Kind.LIGHT
    assert kind_of(ifc_class="IfcCovering")[0] is Kind.LIGHT
    assert kind_of(ifc_class="IfcCovering", layers=[("Beton prefab", 1.0)])[0] is Kind.PRECAST


@pytest.mark.parametrize("name", ["Sparren-12", "Floor joist 45x195", "KROKIEW 8x18"])
def test_names_of_timber_parts_are_assumptions(name: str) -> None:
    assert kind_of(ifc_class="IfcMember", names=(name, None, None), layers=[("Solid", 1.0)]) == (
        Kind.TIMBER,
        Confidence.ASSUMED,
    )


def test_words_of_materials_in_a_name_are_assumptions_and_short_ones_say_nothing() -> None:
    assert kind_of(names=("Basic Roof:Live Roof over Wood Joist", None, None)) == (Kind.TIMBER, Confidence.ASSUMED)
    assert kind_of(names=("Oak Street 4, air", None, None))[0] is Kind.OTHER


def test_shape_comes_last() -> None:
    thin = {"mesh": box(4.0, 0.1, 2.6)}
    assert kind_of(**thin) == (Kind.LIGHT, Confidence.ASSUMED)
    assert kind_of(**thin, layers=[("Concrete", 1.0)])[0] is Kind.CONCRETE
    bar = Facts("IfcBeam", ("First", None, None), (), box(6.0, 0.08, 0.16, tilt_rad=0.5))
    assert kind_of(bar) == (Kind.TIMBER, Confidence.ASSUMED)
    assert kind_of(bar, mesh=box(6.0, 0.3, 0.4))[0] is Kind.OTHER
    roof = Facts("IfcSlab", ("Dach-1", None, None), [("Solid", 0.2)], box(8.0, 10.0, 0.2, tilt_rad=0.5), "ROOF")
    assert kind_of(roof) == (Kind.LIGHT, Confidence.ASSUMED)
    assert kind_of(roof, mesh=box(8.0, 10.0, 0.2))[0] is Kind.OTHER
    assert kind_of(roof, layers=[("Stahlbeton", 0.2)])[0] is Kind.CONCRETE
    gable = trimesh.creation.extrude_triangulation([[-5.0, 0.0], [5.0, 0.0], [0.0, 4.0]], [[0, 1, 2]], 12.0)
    gable.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2.0, (1, 0, 0)))
    whole = Facts("IfcRoof", ("Dach", None, None), (), TriangleMesh(np.array(gable.vertices), np.array(gable.faces)))
    assert kind_of(whole) == (Kind.LIGHT, Confidence.ASSUMED)
    assert kind_of(whole, mesh=box(20.0, 12.0, 0.3))[0] is Kind.OTHER


def test_what_is_too_thin_for_concrete_is_none_whatever_its_name_says() -> None:
    stringer = Facts("IfcMember", ("Stair:Concrete Pan 180mm Riser", None, "Stringer"), (), box(3.8, 0.05, 0.46, 0.5))
    assert kind_of(stringer) == (Kind.TIMBER, Confidence.ASSUMED)
    assert kind_of(stringer, mesh=box(3.8, 0.2, 0.46))[0] is Kind.CONCRETE
    assert kind_of(stringer, layers=[("Concrete", 1.0)])[0] is Kind.CONCRETE
    assert kind_of(stringer, names=("Fascia board", None, None), mesh=box(0.8, 0.03, 0.2))[0] is Kind.TIMBER


@pytest.mark.parametrize("ifc_class", ["IfcStair", "IfcStairFlight", "IfcRamp"])
def test_stone_in_the_name_of_a_stair_is_that_of_its_treads(ifc_class: str) -> None:
    name = ("Stair:Massiv - Stufen Naturstein", None, None)
    assert kind_of(ifc_class=ifc_class, names=name)[0] is Kind.OTHER
    assert kind_of(ifc_class=ifc_class, names=name, layers=[("Naturstein", 1.0)])[0] is Kind.MASONRY
    assert kind_of(ifc_class="IfcSlab", names=name)[0] is Kind.MASONRY


@pytest.mark.parametrize("metal", ["Metal - Firring", "Metal - Steel 43-275", "Aluminium", "Stahlblech"])
def test_a_wall_of_metal_with_other_layers_is_of_sheets_or_panels(metal: str) -> None:
    parapet = {"layers": [(metal, 0.1), ("Air", 0.05), ("Vapour retarder", 0.001)], "mesh": box(50.0, 0.3, 1.0)}
    assert kind_of(**parapet)[0] is Kind.LIGHT


@pytest.mark.parametrize(
    ("ifc_class", "name", "layers", "kind"),
    [
        ("IfcSlab", "Floor: Wood Joist with Subflooring", [("Wood - Dimensional Lumber", 0.2)], Kind.LIGHT),
        ("IfcRoof", "Sparrendach", [], Kind.LIGHT),
        ("IfcSlab", "Holzbalkendecke auf Balkenlage", [("Nadelholz", 0.2)], Kind.LIGHT),
        ("IfcSlab", "Floor panel", [("Cross laminated timber", 0.2)], Kind.TIMBER),
        ("IfcMember", "Floor joist", [], Kind.TIMBER),
        ("IfcSlab", "Concrete on joists", [("Concrete C30/37", 0.2)], Kind.CONCRETE),
    ],
)
def test_a_floor_of_joists_is_built_of_pieces_and_one_of_solid_timber_is_not(
    ifc_class: str, name: str, layers: list[tuple[str, float]], kind: Kind
) -> None:
    found = kind_of(ifc_class=ifc_class, names=(name, None, None), layers=layers, mesh=box(6.0, 5.0, 0.25))
    assert found[0] is kind


def test_what_is_stated_to_be_precast_is_not_what_its_name_only_suggests() -> None:
    panel = {"names": ("P1 facade panel", None, None)}
    assert kind_of(**panel) == (Kind.LIGHT, Confidence.ASSUMED)
    assert kind_of(**panel, casting=Casting.PRECAST) == (Kind.PRECAST, Confidence.STATED)
    assert kind_of(**panel, casting=Casting.PRECAST, layers=[("Aluminium sheet", 0.002)])[0] is not Kind.PRECAST


def test_planes_of_boards_sheets_and_panels_do_not_come_in_one_piece() -> None:
    floor = replace(WALL, ifc_class="IfcSlab", names=("Floor", None, None), layers=[("Chipboard", 1.0)])
    assert kind_of(floor, mesh=box(9.0, 7.0, 0.022))[0] is Kind.LIGHT
    assert kind_of(floor, mesh=box(9.0, 2.4, 0.2))[0] is Kind.TIMBER
    steel = replace(floor, layers=[("Steel", 1.0)])
    assert kind_of(steel, mesh=box(9.0, 9.0, 0.04))[0] is Kind.LIGHT
    assert kind_of(steel, mesh=box(6.0, 2.0, 0.02))[0] is Kind.STEEL
    assert kind_of(steel, names=("Raised Access Floor", None, None), mesh=box(6.0, 2.0, 0.02))[0] is Kind.LIGHT


def test_rooms_come_ready_made_but_their_walls_do_not() -> None:
    pod = Facts("IfcBuildingElementProxy", ("B1", "Baderomskabin", None), (), box(2.2, 1.8, 2.4))
    judgement, casting = judge(pod)
    assert (judgement.kind, casting) == (Kind.PRECAST, Casting.PRECAST)
    assert judgement.why == "'baderomskabin' in its name says rooms that come ready-made"
    assert kind_of(names=("Wand Nasszelle", None, None), layers=[("Gipskarton", 1.0)])[0] is Kind.LIGHT
