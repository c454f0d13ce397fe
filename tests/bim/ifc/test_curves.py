"""Large curves are meshed by the library that keeps a tolerance of 1 mm at any radius."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bimvox.bim.building import Element
from bimvox.bim.ifc.endless import largely_curved
from bimvox.bim.read import read_building

from ..conftest import IfcMaker


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
