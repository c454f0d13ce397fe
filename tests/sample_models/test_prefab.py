"""The building can be planned: no part is drawn into another, every part is supported, and it can be erected."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path
from typing import Any

import ifcopenshell
import ifcopenshell.util.element
import manifold3d
import networkx as nx
import numpy as np
import pytest
from numpy.typing import NDArray
from shapely.geometry import MultiPoint, Point

from sample_models.prefab_shapes import FLIGHT_RUN_M, RISER_M, area_m2, flight_side

TOLERANCE_M = 0.001
SUPPORT_GAP_M = 0.050
STEP_M, SHIFT_M = 0.01, 0.00337


def solid(lift: Any) -> manifold3d.Manifold:
    # ifcopenshell repeats vertices between the faces of booleans: merge them, or the mesh is not closed.
    mesh = manifold3d.Mesh64(lift.vertices_m, lift.faces.astype(np.uint64))
    mesh.merge()
    result = manifold3d.Manifold(mesh)
    assert result.status() == manifold3d.Error.NoError, lift.name
    return result


def neighbours(lifts: list[Any], reach_m: float) -> list[tuple[Any, Any]]:
    def near(a: Any, b: Any) -> bool:
        low_a, high_a = a.bounds_m
        low_b, high_b = b.bounds_m
        return bool(np.all(low_a <= high_b + reach_m) and np.all(low_b <= high_a + reach_m))

    return [(a, b) for a, b in combinations(lifts, 2) if near(a, b)]


def common_heights(a: Any, b: Any) -> tuple[NDArray[np.int64], tuple[NDArray[np.float64], ...]]:
    """Return the plan cell of the common low corner, and bottom and top of a and of b above the common plan cells."""
    (low_a, bottom_a, top_a), (low_b, bottom_b, top_b) = a.heights, b.heights
    low = np.maximum(low_a, low_b)
    high = np.minimum(low_a + bottom_a.shape, low_b + bottom_b.shape)
    if np.any(high <= low):
        return low, tuple(np.zeros((0, 0)) for _ in range(4))

    def crop(array: NDArray[np.float64], own: NDArray[np.int64]) -> NDArray[np.float64]:
        (x0, y0), (x1, y1) = low - own, high - own
        return array[x0:x1, y0:y1]

    return low, (crop(bottom_a, low_a), crop(top_a, low_a), crop(bottom_b, low_b), crop(top_b, low_b))


def bearing(upper: Any, lower: Any) -> NDArray[np.float64]:
    """Return (N, 2) plan points, metres, at which ``upper`` bears on ``lower``."""
    low, (bottom, _, _, top) = common_heights(upper, lower)
    with np.errstate(invalid="ignore"):
        gap = bottom - top
    cells = np.argwhere((gap > -TOLERANCE_M) & (gap <= SUPPORT_GAP_M))
    points: NDArray[np.float64] = (cells + low) * STEP_M + SHIFT_M
    return points


def test_no_part_is_drawn_into_another(prefab_parts: dict[str, Any]) -> None:
    pairs = neighbours(list(prefab_parts.values()), 0.0)
    solids = {id(part): solid(part) for pair in pairs for part in pair}
    shared = {(a.name, b.name): (solids[id(a)] ^ solids[id(b)]).volume() for a, b in pairs}
    assert len(pairs) > 100
    assert {names: volume for names, volume in shared.items() if volume > 1e-9} == {}


@pytest.mark.slow
def test_every_part_rests_on_others_and_does_not_tip(prefab_lifts: list[Any]) -> None:
    loose = []
    for lift in prefab_lifts:
        if lift.is_structure or lift.is_fitting:
            continue
        below = [other for other in prefab_lifts if other is not lift and not other.is_fitting]
        points = np.concatenate([bearing(lift, other) for other in below])
        centre = lift.volume_and_centre[1]
        if len(points) * STEP_M**2 < 0.02 or not MultiPoint(points).convex_hull.buffer(STEP_M).contains(
            Point(centre[:2])
        ):
            loose.append(lift.name)
    assert loose == []
    assert all(abs(lift.bounds_m[0, 2]) < 1e-9 for lift in prefab_lifts if lift.is_structure)


@pytest.mark.slow
def test_some_order_of_straight_descents_builds_it_all(prefab_lifts: list[Any]) -> None:
    order: nx.DiGraph[str] = nx.DiGraph()
    lifts = [lift for lift in prefab_lifts if not lift.is_structure and not lift.is_fitting]
    order.add_nodes_from(lift.name for lift in lifts)
    for a in lifts:
        for b in lifts:
            if a is b:
                continue
            _, (bottom_a, _, _, top_b) = common_heights(a, b)
            with np.errstate(invalid="ignore"):
                above = top_b - bottom_a > TOLERANCE_M
            if np.any(above & np.isfinite(top_b) & np.isfinite(bottom_a)):
                order.add_edge(a.name, b.name, why="blocks")
            elif len(bearing(a, b)):
                order.add_edge(b.name, a.name, why="supports")
    cycle = [] if nx.is_directed_acyclic_graph(order) else nx.find_cycle(order)
    assert cycle == []
    for storey in (0, 1):
        after = nx.descendants(order, f"Stair unit, storey {storey}")
        assert {f"Floor landing, floor {storey + 1}", f"Upper flight, storey {storey}"} <= after


def test_it_is_a_building_of_more_than_a_hundred_lifts(prefab_lifts: list[Any]) -> None:
    lifts = [lift for lift in prefab_lifts if not lift.is_structure and not lift.is_fitting]
    assert 110 <= len(lifts) <= 150
    assert {lift.ifc_class for lift in lifts} >= {"IfcColumn", "IfcBeam", "IfcSlab", "IfcWall", "IfcElementAssembly"}
    assert len({lift.name for lift in prefab_lifts}) == len(prefab_lifts)


def test_stated_quantities_are_those_of_the_geometry(samples: Path, prefab_parts: dict[str, Any]) -> None:
    file = ifcopenshell.open(samples / "prefab.ifc")
    volumes, weights = 0, 0
    for global_id, part in prefab_parts.items():
        said = ifcopenshell.util.element.get_psets(file.by_guid(global_id), qtos_only=True)
        for quantities in said.values():
            assert quantities["NetVolume"] == pytest.approx(part.volume_and_centre[0], rel=1e-4)
            volumes += 1
            if "GrossWeight" in quantities:
                assert 2400 < quantities["GrossWeight"] / quantities["NetVolume"] < 2500
                weights += 1
    assert volumes == 27 + 18 + 56
    assert weights == 18 + 56


def test_materials_come_from_the_type_or_the_part_or_are_not_stated(samples: Path) -> None:
    file = ifcopenshell.open(samples / "prefab.ifc")
    unknown = set()
    for product in file.by_type("IfcElement"):
        if product.is_a("IfcOpeningElement") or product.is_a("IfcElementAssembly"):
            continue
        if ifcopenshell.util.element.get_material(product) is None:
            unknown.add(ifcopenshell.util.element.get_predefined_type(product))
    assert unknown == {"LANDING"}


def test_parts_of_a_type_share_their_geometry(samples: Path) -> None:
    file = ifcopenshell.open(samples / "prefab.ifc")
    assert len(file.by_type("IfcMappedItem")) > 150
    assert (samples / "prefab.ifc").stat().st_size < 1_500_000


def test_flight_closes_the_gap_between_its_landings() -> None:
    outline = np.array(flight_side())
    assert outline[:, 1].max() == pytest.approx(9 * RISER_M)
    assert outline[:, 0].min() == pytest.approx(0.01)
    assert outline[:, 0].max() == pytest.approx(FLIGHT_RUN_M - 0.01)
    assert area_m2([(0, 0), (2, 0), (2, 3), (0, 3)]) == 6
