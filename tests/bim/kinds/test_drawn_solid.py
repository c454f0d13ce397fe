"""Parts that are drawn as one solid block although they are hollow, plates or frames."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
import trimesh

from bimvox.bim.building import TriangleMesh
from bimvox.bim.kinds.evidence import solid_share

CONCRETE, STEEL, TIMBER = 2500.0, 7850.0, 500.0
RISER_M, GOING_M, WIDTH_M = 0.17, 0.28, 1.2


def body(*outlines: Sequence[tuple[float, float]], width_m: float = WIDTH_M, turned_rad: float = 0.0) -> TriangleMesh:
    """Return the pieces with these convex outlines in x and z, turned about the vertical."""
    pieces = [
        trimesh.convex.convex_hull([(x, y, z) for x, z in outline for y in (0.0, width_m)]) for outline in outlines
    ]
    shape = trimesh.util.concatenate(pieces)
    shape.apply_transform(trimesh.transformations.rotation_matrix(turned_rad, (0, 0, 1)))
    return TriangleMesh(np.asarray(shape.vertices), np.asarray(shape.faces, np.int32))


def box(length_m: float, width_m: float, height_m: float, turned_rad: float = 0.0) -> TriangleMesh:
    outline = [(0.0, 0.0), (length_m, 0.0), (length_m, height_m), (0.0, height_m)]
    return body(outline, width_m=width_m, turned_rad=turned_rad)


def wedge(length_m: float, height_m: float, turned_rad: float = 0.0) -> TriangleMesh:
    return body([(0.0, 0.0), (length_m, 0.0), (length_m, height_m)], turned_rad=turned_rad)


def steps(count: int, waist_m: float | None) -> TriangleMesh:
    """Return a flight with steps: on a plate with a sloping soffit, or solid down to the floor."""
    outlines = []
    for n in range(count):
        x0, x1, top = n * GOING_M, (n + 1) * GOING_M, (n + 1) * RISER_M
        under = [(n + i) * RISER_M - waist_m if waist_m is not None else 0.0 for i in (0, 1)]
        outlines.append([(x0, under[0]), (x1, under[1]), (x1, top), (x0, top)])
    return body(*outlines)


def share_of(
    ifc_class: str, mesh: TriangleMesh, kg_m3: float = CONCRETE, name: str = "", kind: str | None = None
) -> float | None:
    return solid_share(ifc_class, (name, None, None), kind, mesh, abs(mesh.signed_volume_m3), kg_m3)


@pytest.mark.parametrize(
    ("ifc_class", "name", "share"),
    [
        ("IfcSlab", "Kanaalplaatvloer 200", 0.65),
        ("IfcSlab", "Ontelolaatta O27", 0.65),
        ("IfcSlab", "TT-plaat 350", 0.5),
        ("IfcBuildingElementProxy", "Bathroom pod 1", 0.12),
        ("IfcWall", "Bathroom pod 1", None),
        ("IfcSlab", "Breedplaat 60", None),
        ("IfcSlab", "", None),
    ],
)
def test_what_is_hollow_although_it_is_drawn_solid(ifc_class: str, name: str, share: float | None) -> None:
    assert share_of(ifc_class, box(6.0, 1.2, 0.2), name=name) == share
    assert share_of(ifc_class, box(6.0, 1.2, 0.2, turned_rad=0.5), name=name) == share, "its box is not upright"
    assert share_of("IfcBeam", box(6.0, 1.2, 0.2), kind="HOLLOWCORE") == 0.65


@pytest.mark.parametrize("mesh", [box(2.8, WIDTH_M, 1.7), wedge(2.8, 1.7, turned_rad=0.6), steps(10, None)])
@pytest.mark.parametrize(
    ("kg_m3", "most_kg_m2", "least_kg_m2"), [(CONCRETE, 750.0, 550.0), (STEEL, 150.0, 70.0), (TIMBER, 60.0, 25.0)]
)
def test_a_flight_that_is_drawn_solid_weighs_as_a_plate_with_steps(
    mesh: TriangleMesh, kg_m3: float, most_kg_m2: float, least_kg_m2: float
) -> None:
    share = share_of("IfcStairFlight", mesh, kg_m3)
    assert share is not None
    kg_m2 = share * kg_m3 * abs(mesh.signed_volume_m3) / (WIDTH_M * np.hypot(2.8, 1.7))
    assert least_kg_m2 < kg_m2 < most_kg_m2


def test_a_flight_is_known_by_its_class_or_its_name() -> None:
    block = box(2.8, WIDTH_M, 1.7)
    flight = share_of("IfcStairFlight", block)
    for ifc_class, name in (
        ("IfcStair", ""),
        ("IfcRamp", ""),
        ("IfcSlab", "Treppenlauf 3"),
        ("IfcProxy", "Biegi schodowe"),
    ):
        assert share_of(ifc_class, block, name=name) == flight
    assert share_of("IfcWall", block, name="Treppenhaus") is None
    assert share_of("IfcSlab", block) is None


@pytest.mark.parametrize(
    "mesh",
    [steps(10, 0.2), steps(18, 0.15), steps(3, None), box(2.5, 1.3, 0.25), box(4.0, 0.1, 3.0), box(1.2, 0.5, 0.5)],
)
def test_flights_with_a_soffit_few_steps_landings_and_stringers_weigh_what_is_drawn(mesh: TriangleMesh) -> None:
    assert share_of("IfcStairFlight", mesh) is None


@pytest.mark.parametrize(
    ("name", "kg_m3", "mesh", "least_kg", "most_kg"),
    [
        # a roof truss with nail plates, 10 m: about 70 kg; of steel, 24 m by 2 m: 60 to 150 kg/m; of glued timber: 2 t
        ("Nagelplattenbinder", TIMBER, body([(0.0, 0.0), (10.0, 0.0), (5.0, 2.0)], width_m=0.045), 50.0, 120.0),
        ("Roof truss T1", STEEL, box(24.0, 0.2, 2.0, turned_rad=0.3), 1500.0, 4000.0),
        ("Ferma dachowa - kratownica", TIMBER, box(24.0, 0.2, 2.4), 1200.0, 4500.0),
        ("Space frame", STEEL, box(20.0, 2.0, 2.0), 2000.0, 12000.0),
    ],
)
def test_a_frame_that_is_drawn_solid_weighs_as_its_chords_and_webs(
    name: str, kg_m3: float, mesh: TriangleMesh, least_kg: float, most_kg: float
) -> None:
    share = share_of("IfcBeam", mesh, kg_m3, name)
    assert share is not None
    assert least_kg < share * kg_m3 * abs(mesh.signed_volume_m3) < most_kg
    assert share_of("IfcElementAssembly", mesh, kg_m3, kind="TRUSS") == share


def test_bars_of_a_frame_and_frames_with_gaps_weigh_what_is_drawn() -> None:
    chord, gusset = box(12.0, 0.2, 0.3), box(0.6, 0.02, 0.5)
    assert share_of("IfcMember", chord, TIMBER, "Truss T1 bottom chord") is None
    assert share_of("IfcPlate", gusset, STEEL, "Truss T1 gusset") is None
    bars = [[(0.0, z), (12.0, z), (12.0, z + 0.2), (0.0, z + 0.2)] for z in (0.0, 1.8)]
    assert share_of("IfcBeam", body(*bars, width_m=0.2), STEEL, "Truss T1") is None
    assert share_of("IfcSlab", box(6.0, 2.4, 0.6), CONCRETE, "Lattice girder slab") is None


def test_a_tank_of_sheets_and_one_of_concrete_weigh_what_is_drawn() -> None:
    block = box(2.0, 2.0, 2.0)
    for volume_m3, kg_m3, share in ((8.0, STEEL, 120.0 / STEEL), (0.2, STEEL, None), (3.0, CONCRETE, None)):
        found = solid_share("IfcTank", ("T1", None, None), None, block, volume_m3, kg_m3)
        assert found == (None if share is None else pytest.approx(share))
    sheets = solid_share("IfcTank", ("T1", None, None), None, block, 0.2, 2400.0, is_assumed=True)
    assert sheets == pytest.approx(120.0 * 8.0 / (0.2 * 2400.0)), "of nothing known, by its hull"
