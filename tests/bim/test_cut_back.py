"""Beams of steel that are drawn to the axes of what they join end at its faces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from box_buildings import box_element, building_of

from bimvox.bim.building import Building, TriangleMesh
from bimvox.bim.cut_back import cut_back
from bimvox.bim.kinds.kind import Judgement, Kind

STEEL = {"judgement": Judgement(Kind.STEEL)}


def column(name: str, x: float, y: float, high: float = 5.0, **more: object):
    low, top = (x - 0.15, y - 0.15, 0.0), (x + 0.15, y + 0.15, high)
    return box_element(name, low, top, ifc_class="IfcColumn", **{**STEEL, **more})


def beam(name: str, low: tuple, high: tuple, **more: object):
    return box_element(name, low, high, **{**STEEL, **more})


def spans_m(building: Building, axis: int = 0) -> dict[str, list[float]]:
    found = cut_back(building)
    return {one.id: one.mesh.bounds_m[:, axis].round(4).tolist() for one in found.elements}


def test_beams_between_the_axes_of_columns_end_at_their_faces() -> None:
    posts = [column(f"c{n}", x, 0.0) for n, x in enumerate((0.0, 6.0, 12.0))]
    beams = [beam(f"b{n}", (x, -0.1, 4.5), (x + 6.0, 0.1, 5.0)) for n, x in enumerate((0.0, 6.0))]
    building = building_of(*posts, *beams)
    spans = spans_m(building)
    assert (spans["b0"], spans["b1"]) == ([0.155, 5.845], [6.155, 11.845])
    assert spans["c0"] == [-0.15, 0.15]
    (note,) = cut_back(building).notes
    assert note == "2 beams of steel are drawn into what joins their ends, so taken as cut at the faces: b0, b1"
    assert [one.mass_kg for one in cut_back(building).elements] == [one.mass_kg for one in building.elements]


def test_a_turned_frame_is_cut_as_well() -> None:
    turn = np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
    parts = [column("c", 0.0, 0.0), beam("b", (0.0, -0.1, 4.5), (6.0, 0.1, 5.0))]
    turned = [replace(one, mesh=TriangleMesh(one.mesh.vertices_m @ turn.T, one.mesh.faces)) for one in parts]
    found = cut_back(building_of(*turned)).elements[1].mesh.vertices_m @ turn
    assert (found[:, 0].min(), found[:, 0].max()) == (pytest.approx(0.155), pytest.approx(6.0))


def test_a_beam_between_the_flanges_of_a_column_ends_at_its_web() -> None:
    web = column("c", 0.0, 0.0)
    plates = [box_element("p", (-0.005, -0.15, 0.0), (0.005, 0.15, 5.0)).mesh]
    plates += [box_element("p", (-0.15, y, 0.0), (0.15, y + 0.02, 5.0)).mesh for y in (-0.15, 0.13)]
    profile = replace(web, mesh=TriangleMesh.joined(plates))
    narrow, wide = (beam(f"{half}", (0.0, -half, 4.5), (6.0, half, 5.0)) for half in (0.1, 0.14))
    assert spans_m(building_of(profile, narrow))["0.1"] == [0.01, 6.0]
    assert spans_m(building_of(profile, wide))["0.14"] == [0.155, 6.0]


def test_a_secondary_beam_ends_at_the_side_of_the_main_beam_and_the_main_beam_stays() -> None:
    main = beam("main", (0.0, -0.1, 4.5), (9.0, 0.1, 5.0))
    secondary = beam("secondary", (4.4, 0.0, 4.6), (4.6, 5.0, 4.9))
    building = building_of(main, secondary)
    assert spans_m(building, 1)["secondary"] == [0.105, 5.0]
    assert spans_m(building)["main"] == [0.0, 9.0]


def test_at_a_corner_of_two_beams_the_lighter_one_is_cut() -> None:
    heavy, light = beam("heavy", (0.0, -0.1, 4.5), (9.0, 0.1, 5.0)), beam("light", (-0.05, 0.0, 4.6), (0.05, 5.0, 4.9))
    building = building_of(light, heavy)
    assert spans_m(building, 1)["light"] == [0.105, 5.0]
    assert spans_m(building)["heavy"] == [0.0, 9.0]


@pytest.mark.parametrize(
    "other",
    [
        column("c", 0.0, 0.0, high=4.5),  # the beam lies on it
        column("c", 0.0, 0.0, judgement=Judgement(Kind.CONCRETE)),
        column("c", 3.0, 0.0),  # it runs through, and does not end there
        beam("c", (-3.0, -0.1, 4.5), (2.0, 0.1, 5.0)),  # along it: drawn twice, or spliced
        column("c", -0.155, 0.0),
    ],
)
def test_what_is_no_joint_is_not_cut(other) -> None:
    building = building_of(other, beam("b", (0.0, -0.1, 4.5), (6.0, 0.1, 5.0)))
    assert cut_back(building) is building


def test_a_beam_of_concrete_or_a_stub_that_lies_wholly_in_a_column_is_left_as_it_is() -> None:
    stub = beam("stub", (0.0, -0.02, 4.5), (0.16, 0.02, 4.55))
    concrete = beam("concrete", (0.0, -0.1, 4.5), (6.0, 0.1, 5.0), judgement=Judgement(Kind.CONCRETE))
    building = building_of(column("c", 0.0, 0.0), stub, concrete)
    assert cut_back(building) is building
