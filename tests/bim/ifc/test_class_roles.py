from __future__ import annotations

from pathlib import Path

import ifcopenshell
import numpy as np
import pytest

from bimvox.bim.building import Element, Role, TriangleMesh
from bimvox.bim.ifc.class_roles import (
    NOT_SOLID,
    ROLES,
    SPLIT,
    TOO_SMALL,
    UNKNOWN,
    by_default,
    reason_not_solid,
    reason_too_small,
    role_of_class,
)
from bimvox.bim.kinds.kind import Confidence
from bimvox.bim.read import ReadOptions, read_building
from bimvox.site.config.site_config import MeansConfig
from bimvox.site.means import may_be_cast

from ..conftest import IfcMaker

_SCHEMAS = ("IFC2X3", "IFC4", "IFC4X3_ADD2")


@pytest.mark.parametrize("schema", _SCHEMAS)
@pytest.mark.parametrize(
    ("ifc_class", "role"),
    [
        ("IfcColumn", Role.COMPONENT),
        ("IfcWallStandardCase", Role.COMPONENT),
        ("IfcStairFlight", Role.COMPONENT),
        ("IfcFooting", Role.STRUCTURE),
        ("IfcPile", Role.STRUCTURE),
        ("IfcDoor", Role.FITTING),
        ("IfcCurtainWall", Role.FITTING),
        ("IfcFlowTerminal", Role.FITTING),
        ("IfcBuildingElementProxy", Role.FITTING),
        ("IfcSite", Role.GROUND),
        ("IfcTask", None),
    ],
)
def test_roles(schema: str, ifc_class: str, role: Role | None) -> None:
    if schema == "IFC4X3_ADD2" and ifc_class == "IfcWallStandardCase":
        ifc_class = "IfcWall"
    assert role_of_class(schema, ifc_class) is role


@pytest.mark.parametrize("schema", _SCHEMAS)
def test_spaces_openings_and_sites(schema: str) -> None:
    assert reason_not_solid(schema, "IfcSpace")
    assert reason_not_solid(schema, "IfcOpeningElement")
    assert reason_not_solid(schema, "IfcSite") is None
    assert reason_not_solid(schema, "IfcBeam") is None
    assert reason_too_small(schema, "IfcReinforcingBar")
    assert reason_too_small(schema, "IfcMechanicalFastener")
    assert reason_too_small(schema, "IfcBeam") is None


def test_every_class_in_the_tables_exists_in_some_schema() -> None:
    declared = set()
    for schema in _SCHEMAS:
        declared |= {entity.name() for entity in ifcopenshell.ifcopenshell_wrapper.schema_by_name(schema).entities()}
    assert {*ROLES, *NOT_SOLID, *TOO_SMALL, *SPLIT, *UNKNOWN} <= declared


_CORNERS = np.array(np.meshgrid([0, 1], [0, 1], [0, 1], indexing="ij"), dtype=np.float64).reshape(3, -1).T
_QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
_CUBE = TriangleMesh(
    _CORNERS,
    np.array([t for a, b, c, d in _QUADS for t in ((a, b, c), (a, c, d))], dtype=np.int32),
)


def element(name: str, mass_kg: float = 2500.0, **changes: object) -> Element:
    values: dict[str, object] = {"ifc_class": "IfcSlab", "role": Role.COMPONENT, "mass_source": "density", **changes}
    return Element(id=name, global_id=name, name=name, mesh=_CUBE, mass_kg=mass_kg, **values)  # type: ignore[arg-type]


def roles(elements: list[Element]) -> tuple[dict[str, Role], str]:
    notes: list[str] = []
    return {one.name: one.role for one in by_default(elements, notes)}, " ".join(notes)


def test_insulation_is_laid_by_hand() -> None:
    found, said = roles([element("slab"), element("EPS", 40.0), element("studs", 100.0)])
    assert found == {"slab": Role.COMPONENT, "EPS": Role.FITTING, "studs": Role.COMPONENT}
    assert "insulation and air (under 60 kg/m3), treated as fittings: 1" in said


@pytest.mark.parametrize("source", ["quantity", "default"])
def test_only_a_known_material_is_insulation(source: str) -> None:
    found, _ = roles([element("slab"), element("hollow", 40.0, mass_source=source)])
    assert found["hollow"] is Role.COMPONENT


def test_a_model_of_nothing_else_keeps_its_parts() -> None:
    found, said = roles([element("EPS", 40.0), element("XPS", 40.0)])
    assert set(found.values()) == {Role.COMPONENT}
    assert said == ""


def test_light_parts_are_fittings() -> None:
    found, said = roles([element("slab"), element("nut", 0.2)])
    assert found["nut"] is Role.FITTING
    assert "insulation" in said


def test_curtain_panels_and_what_exists_in_a_file(maker: type[IfcMaker], tmp_path: Path) -> None:
    made = maker()
    made.box("IfcBeam", Name="beam")
    made.box("IfcPlate", (2, 0, 0), Name="glass", PredefinedType="CURTAIN_PANEL")
    made.box("IfcMember", (4, 0, 0), Name="post", PredefinedType="MULLION")
    made.box("IfcMember", (6, 0, 0), Name="brace", PredefinedType="BRACE")
    made.box("IfcSlab", (8, 0, 0), Name="Existing Strip Footing")
    path = made.write(tmp_path / "curtain.ifc")
    assert {one.name: one.role for one in read_building(path).elements} == {
        "beam": Role.COMPONENT,
        "glass": Role.FITTING,
        "post": Role.FITTING,
        "brace": Role.COMPONENT,
        "Existing Strip Footing": Role.STRUCTURE,
    }
    selected = read_building(path, ReadOptions(select="IfcPlate")).elements
    assert [one.role for one in selected if one.name == "glass"] == [Role.COMPONENT]


def test_machines_tanks_containers_and_noise_barriers_in_the_open_are_lifted(
    maker: type[IfcMaker], tmp_path: Path
) -> None:
    made = maker()
    made.box("IfcSlab", (0, 0, 3), (20, 20, 0.3), Name="roof")
    made.box("IfcBuildingElementProxy", (2, 2, 3.3), (4, 2, 2), Name="RTU-1", ObjectType="Rooftop unit")
    made.material(made.box("IfcChiller", (8, 2, 3.3), (3, 1.5, 2), Name="K1"), "Metal - Aluminium")
    made.box("IfcTank", (2, 2, 0), (2, 2, 2), Name="Buffer tank")
    made.box("IfcTank", (25, 2, 0), (2, 2, 2), Name="Fuel tank")
    made.box("IfcBuildingElementProxy", (30, 2, 0), (6.1, 2.4, 2.6), Name="Bürocontainer")
    made.box("IfcUnitaryEquipment", (12, 2, 3.3), (0.8, 0.5, 0.6), Name="split unit")
    made.box("IfcBuildingElementProxy", (0, 40, 0), (4, 0.12, 2), Name="Lärmschutzwand 3")
    made.box("IfcWall", (6, 40, 0), (4, 0.12, 2), Name="Noise barrier 4")
    made.box("IfcBuildingElementProxy", (40, 40, 0), (2, 2, 5), Name="Tree")
    made.box("IfcFurnishingElement", (40, 30, 0), (2, 2, 5), Name="Tank")
    building = read_building(made.write(tmp_path / "machines.ifc"))
    lifted = {one.name: one for one in building.elements if one.role is Role.COMPONENT}
    assert set(lifted) == {"roof", "RTU-1", "K1", "Fuel tank", "Bürocontainer", "Lärmschutzwand 3", "Noise barrier 4"}
    kg = {name: round(one.mass_kg) for name, one in lifted.items()}
    assert (kg["RTU-1"], kg["K1"], kg["Fuel tank"], kg["Lärmschutzwand 3"]) == (4800, 2700, 960, 2304)
    assert {one.judgement.confidence for name, one in lifted.items() if name != "roof"} == {Confidence.ASSUMED}
    assert all(
        may_be_cast(one, MeansConfig()) == (name not in ("RTU-1", "K1", "Fuel tank", "Bürocontainer"))
        for name, one in lifted.items()
    )
    assert "machines, tanks and containers under a roof, treated as fittings: 1 (Buffer tank)" in building.notes
    assert any(note.startswith("machines, tanks, containers and noise barriers, lifted: 5") for note in building.notes)
