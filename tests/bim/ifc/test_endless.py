"""What would take the geometry kernel minutes is found before it is asked."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bimvox.bim.building import Element
from bimvox.bim.ifc import endless
from bimvox.bim.ifc.endless import largely_curved
from bimvox.bim.ifc.geometry import GeometryPool
from bimvox.bim.read import read_building
from bimvox.errors import IfcError

from ..conftest import IfcMaker


def star(made: IfcMaker, points: int, kind: str) -> None:
    """Give a new wall a star of so many points as its outline."""
    turn = np.linspace(0.0, 2.0 * np.pi, points, endpoint=False)
    corners = np.stack([np.cos(turn), np.sin(turn)], axis=1) * (1.0 + 0.1 * (np.arange(points) % 2))[:, None]
    file = made.file
    if kind == "list":
        curve = file.create_entity(
            "IfcIndexedPolyCurve", file.create_entity("IfcCartesianPointList2D", corners.tolist())
        )
    else:
        own = [file.create_entity("IfcCartesianPoint", corner) for corner in corners.tolist()]
        curve = file.create_entity("IfcPolyline", [*own, own[0]])
    profile = file.create_entity("IfcArbitraryClosedProfileDef", "AREA", None, curve)
    made.box("IfcWall").Representation.Representations[0].Items[0].SweptArea = profile


@pytest.mark.parametrize("kind", ["list", "points"])
def test_a_part_with_too_many_points_is_skipped_with_its_reason(
    kind: str, maker: type[IfcMaker], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(endless, "MOST_POINTS", 500)
    made = maker()
    star(made, 1000, kind)
    star(made, 400, kind)
    with pytest.raises(IfcError, match=r"1 x an outline of it has 1,00[01] points, more than 500"):
        only = maker()
        star(only, 1000, kind)
        read_building(only.write(tmp_path / "only.ifc"))
    building = read_building(made.write(tmp_path / "a.ifc"))
    assert len(building.elements) == 1
    (skipped,) = building.skipped
    assert "points, more than 500" in skipped.reason


@pytest.mark.parametrize("between", ["nothing", "a boolean", "a solid"])
def test_a_part_that_is_cut_by_itself_is_skipped_at_once(
    between: str, maker: type[IfcMaker], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = maker()
    shape = made.box("IfcWall").Representation.Representations[0]
    made.box("IfcWall")
    good = made.box("IfcWall").Representation.Representations[0]
    (solid,), (other,) = shape.Items, good.Items
    good.Items = [made.file.create_entity("IfcBooleanResult", "UNION", other, other)]
    cut = made.file.create_entity("IfcBooleanResult", "DIFFERENCE", solid, solid)
    inner = {
        "nothing": lambda: cut,
        "a boolean": lambda: made.file.create_entity("IfcBooleanResult", "UNION", solid, cut),
        "a solid": lambda: made.file.create_entity("IfcCsgSolid", cut),
    }[between]()
    cut.SecondOperand = inner
    shape.Items = [cut]
    asked = []
    mesh = GeometryPool.mesh
    monkeypatch.setattr(
        GeometryPool,
        "mesh",
        lambda pool, groups, *more, **given: (asked.extend(groups), mesh(pool, groups, *more, **given))[1],
    )
    building = read_building(made.write(tmp_path / "a.ifc"))
    assert len(building.elements) == 2
    (skipped,) = building.skipped
    assert skipped.reason == "a boolean operation in it has itself as operand"
    assert sum(map(len, asked)) == 2, "the kernel was asked for it"


@pytest.mark.parametrize("ring", [1, 2, 5])
def test_a_part_in_a_circle_of_wholes_is_left_out_by_name(ring: int, maker: type[IfcMaker], tmp_path: Path) -> None:
    made = maker()
    beam, good = made.box("IfcBeam", Name="Beam in the circle"), made.box("IfcBeam")
    wholes = [made.rooted("IfcElementAssembly") for _ in range(ring)]
    made.rooted("IfcRelAggregates", RelatingObject=wholes[0], RelatedObjects=[beam])
    for one, other in zip(wholes, wholes[1:] + wholes[:1], strict=True):
        made.rooted("IfcRelAggregates", RelatingObject=other, RelatedObjects=[one])
    building = read_building(made.write(tmp_path / "a.ifc"))
    assert [element.id for element in building.elements] == [good.GlobalId]
    (note,) = building.notes
    assert "1 product is left out" in note
    assert "Beam in the circle" in note


@pytest.mark.slow
@pytest.mark.parametrize("levels, read", [(20, 2), (1500, 1)])
def test_assemblies_nested_without_end_are_left_out(
    levels: int, read: int, maker: type[IfcMaker], tmp_path: Path
) -> None:
    made = maker()
    part, _ = made.box("IfcBeam"), made.box("IfcBeam")
    for _ in range(levels):
        whole = made.rooted("IfcElementAssembly")
        made.aggregate(whole, [part])
        part = whole
    assert len(read_building(made.write(tmp_path / "a.ifc")).elements) == read


def round_column(made: IfcMaker, radius: float, ifc_class: str = "IfcColumn") -> Any:
    column = made.box(ifc_class)
    body = column.Representation.Representations[0].Items[0]
    body.SweptArea = made.file.create_entity("IfcCircleProfileDef", "AREA", None, None, radius)
    return column


def arc_wall(made: IfcMaker, bulge: float) -> Any:
    """Make a plate of 2 units with one arched side."""
    wall = made.box("IfcWall")
    points = made.file.create_entity("IfcCartesianPointList2D", [[0.0, 0.0], [2.0, 0.0], [1.0, bulge]])
    arc = made.file.create_entity("IfcArcIndex", (2, 3, 1))
    line = made.file.create_entity("IfcLineIndex", (1, 2))
    curve = made.file.create_entity("IfcIndexedPolyCurve", points, [line, arc], False)
    profile = made.file.create_entity("IfcArbitraryClosedProfileDef", "AREA", None, curve)
    wall.Representation.Representations[0].Items[0].SweptArea = profile
    return wall


@pytest.mark.parametrize("unit", ["m", "mm"])
def test_which_are_largely_curved(maker: type[IfcMaker], unit: str) -> None:
    made, metre = maker(unit=unit), {"m": 1.0, "mm": 1000.0}[unit]
    round_column(made, 0.4 * metre)
    large = [round_column(made, 3.0 * metre)]
    host = made.box("IfcSlab")
    opening = round_column(made, 2.0 * metre, "IfcOpeningElement")
    made.rooted("IfcRelVoidsElement", RelatingBuildingElement=host, RelatedOpeningElement=opening)
    large.append(host)
    plan = round_column(made, 2.0 * metre, "IfcDoor")
    plan.Representation.Representations[0].RepresentationType = "Annotation2D"
    assert largely_curved(made.file, 1.0 / metre) == {product.id() for product in large}


def test_arcs_by_their_radius(maker: type[IfcMaker]) -> None:
    made = maker()
    shallow, straight, half = arc_wall(made, 0.1), arc_wall(made, 0.0), arc_wall(made, 1.0)
    assert largely_curved(made.file, 1.0) == {shallow.id(), half.id()}
    assert largely_curved(made.file, 0.5) == {shallow.id()}
    assert straight.is_a("IfcWall")


@pytest.mark.parametrize("radius_m", [0.05, 0.5, 0.79, 0.81, 5.0, 25.0])
def test_whatever_the_radius_a_column_is_round_to_a_millimetre(
    maker: type[IfcMaker], tmp_path: Path, radius_m: float
) -> None:
    made = maker()
    round_column(made, radius_m)
    (element,) = read_building(made.write(tmp_path / "round.ifc")).elements
    assert deepest_chord_m(element, radius_m) < 0.00101


def deepest_chord_m(element: Element, radius_m: float) -> float:
    """Return how far the edges on the rim are inside the circle."""
    at = element.mesh.vertices_m[:, :2]
    assert np.linalg.norm(at, axis=1).max() == pytest.approx(radius_m, abs=1e-9)
    angles = np.unique(np.round(np.arctan2(at[:, 1], at[:, 0])[np.linalg.norm(at, axis=1) > radius_m * 0.99], 9))
    step = np.diff(np.append(angles, angles[0] + 2 * np.pi)).max()
    return float(radius_m * (1 - np.cos(step / 2)))
