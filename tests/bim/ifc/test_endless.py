"""What would take the geometry kernel minutes is found before it is asked."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bimvox.bim.ifc import endless
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


def test_parts_that_contain_themselves_are_refused_by_name(maker: type[IfcMaker], tmp_path: Path) -> None:
    made = maker()
    beam = made.box("IfcBeam")
    one, other = made.rooted("IfcElementAssembly"), made.rooted("IfcElementAssembly")
    made.rooted("IfcRelAggregates", RelatingObject=one, RelatedObjects=[other, beam])
    made.rooted("IfcRelAggregates", RelatingObject=other, RelatedObjects=[one])
    with pytest.raises(IfcError, match="contain themselves") as refused:
        read_building(made.write(tmp_path / "a.ifc"))
    assert one.GlobalId in str(refused.value)
    assert other.GlobalId in str(refused.value)
