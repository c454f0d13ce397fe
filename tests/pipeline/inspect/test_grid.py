"""The table of parts agrees with the cells of the grid, and one part is described in full."""

from __future__ import annotations

import json

import numpy as np
import pytest
import trimesh
from bimvox_pipeline.inspect.grid import describe_grid, describe_part, describe_parts, describe_totals

from bimvox.bim.building import Building, Element, Role, Source, TriangleMesh
from bimvox.errors import InputError
from bimvox.grid.voxel_grid import VoxelGrid
from bimvox.voxelization.building import voxelize_building

SIZE = 0.5


def block(
    name: str, low: tuple[float, float, float], size: tuple[float, float, float], role: Role = Role.COMPONENT
) -> Element:
    box = trimesh.creation.box(size)
    vertices = np.array(box.vertices) + np.array(low) + np.array(size) / 2
    mesh = TriangleMesh(vertices, np.array(box.faces, dtype=np.int32))
    kg = float(np.prod(size)) * 2500
    return Element(f"id-{name}", f"guid-{name}", "IfcWall", name, mesh, role, kg, "density", "W20", "01", "Concrete")


@pytest.fixture(scope="module")
def grid() -> VoxelGrid:
    elements = (
        block("a", (0, 0, 0), (2, 1, 1)),
        block("b", (2.0, 0, 0), (1.25, 1, 1)),
        block("c", (3.25, 0, 0), (1.75, 1, 1)),
        block("twin", (0, 3, 0), (1, 1, 1), Role.STRUCTURE),
        block("twin", (0, 5, 0), (1, 1, 1), Role.STRUCTURE),
    )
    named = [*elements[:4], Element(**{**_values(elements[4]), "id": "id-twin#2", "global_id": "guid-twin#2"})]
    return voxelize_building(Building(tuple(named), (), Source("t.ifc", "0" * 64, "IFC4", "m")), SIZE)


def _values(element: Element) -> dict[str, object]:
    return {name: getattr(element, name) for name in Element.__slots__}


def test_the_row_of_a_part(grid: VoxelGrid) -> None:
    assert describe_parts(grid)[1] == {
        "id": "id-b",
        "global_id": "guid-b",
        "ifc_class": "IfcWall",
        "type_name": "W20",
        "name": "b",
        "role": "component",
        "storey": "01",
        "material": "Concrete",
        "mass_kg": 3125.0,
        "mass_source": "density",
        "cells": 12,
        "solid_volume_m3": pytest.approx(1.25),
        "fill_fraction": pytest.approx(1.25 / (12 * SIZE**3)),
        "fill": "winding",
        "boxes": 1,
        "shared_cells": 4,
    }


def test_boxes_cover_the_cells_of_every_part(grid: VoxelGrid) -> None:
    for row in describe_parts(grid):
        part = describe_part(grid, row["id"])
        boxes = np.array(part["box_cells"])
        assert len(boxes) == row["boxes"]
        assert np.prod(boxes[:, 3:] - boxes[:, :3], axis=1).sum() == row["cells"]


def test_one_part_in_full(grid: VoxelGrid) -> None:
    part = describe_part(grid, "b")
    assert part["bounds_m"] == [[2.0, 0.0, 0.0], [3.5, 1.0, 1.0]]
    assert part["shares_cells_with"] == [{"id": "id-c", "name": "c", "cells": 4}]
    assert describe_part(grid, "guid-b") == describe_part(grid, "id-b") == part


def test_a_missing_part_or_an_ambiguous_one(grid: VoxelGrid) -> None:
    with pytest.raises(InputError, match="2 parts have the name 'twin'") as caught:
        describe_part(grid, "twin")
    assert caught.value.hint == "give an id: id-twin, id-twin#2"
    with pytest.raises(InputError, match="no part") as caught:
        describe_part(grid, "id-twinn")
    assert "id-twin" in (caught.value.hint or "")
    with pytest.raises(InputError, match="no part"):
        describe_part(grid, "")


def test_sums_by_role_and_over_all(grid: VoxelGrid) -> None:
    totals = describe_totals(describe_parts(grid))
    assert {role: sums["parts"] for role, sums in totals.items()} == {"component": 3, "structure": 2, "all": 5}
    assert totals["component"]["mass_kg"] == pytest.approx(5 * 2500)
    assert totals["all"]["cells"] == sum(part.cells for part in grid.parts)


def test_the_document_is_plain(grid: VoxelGrid) -> None:
    document = describe_grid(grid)
    assert json.loads(json.dumps(document, allow_nan=False)) == document
    assert document["shared_cells"] == 4
    assert json.dumps(describe_part(grid, "b"))
