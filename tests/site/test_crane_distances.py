from __future__ import annotations

import dataclasses
from math import hypot, sqrt

import numpy as np
import pytest
from box_sites import box_site
from box_sites import test_crane as crane_at
from hypothesis import given, settings
from hypothesis import strategies as st
from log_building import box_mesh
from named_cranes import MOBILE_CRANES

from bimvox.bim.building import TriangleMesh
from bimvox.crane.outline import outline_of, tail_low_m
from bimvox.site.crane_distances import FOUNDATION_MASTS, Thing, base_of, fixed_things, of_crane, to_areas

CRANE = crane_at(base=(10.0, 10.0, 0.0), jib=30.0, height=20.0)


def thing(low, high, kind="building"):
    return Thing.of(kind, "box", box_mesh(low, high))


def found(*things, crane=CRANE, most_m=None):
    return {(one.piece, one.kind): one for one in of_crane(crane, things, most_m)}


def test_the_mast_is_measured_from_its_face_and_the_foundation_from_its_edge() -> None:
    near = found(thing((14.0, 9.0, -1.0), (16.0, 11.0, 5.0)))
    assert near["mast", "building"].distance_m == pytest.approx(4.0 - 0.8)
    assert near["base", "building"].distance_m == pytest.approx(4.0 - FOUNDATION_MASTS * 1.6 / 2.0)
    assert near["mast", "building"].ends_m[0] == pytest.approx((10.8, 10.0), abs=1.01)


def test_a_corner_is_measured_askew() -> None:
    near = found(thing((13.8, 14.8, 0.0), (20.0, 20.0, 5.0)))
    assert near["mast", "building"].distance_m == pytest.approx(hypot(3.0, 4.0))


def test_only_what_is_level_with_a_piece_counts() -> None:
    over = found(thing((12.0, 9.0, 12.0), (20.0, 11.0, 13.0)))  # a bridge over the foundation
    assert ("base", "building") not in over
    assert over["mast", "building"].distance_m == pytest.approx(2.0 - 0.8)
    beam = TriangleMesh(np.array([[12.0, 10.0, 30.0], [18.0, 10.0, 10.0], [18.0, 10.2, 10.0]]), np.array([[0, 1, 2]]))
    sloping = found(Thing.of("building", "rafter", beam))
    top_m = tail_low_m(CRANE)  # where the mast ends, the rafter is this far from the axis
    assert sloping["mast", "building"].distance_m == pytest.approx(2.0 + 6.0 * (30.0 - top_m) / 20.0 - 0.8, abs=1e-6)


def test_the_counterweight_is_measured_aside_and_below() -> None:
    tail_m, low_m = outline_of(CRANE).tail_m, tail_low_m(CRANE)
    aside = found(thing((10.0 + tail_m + 0.3, 9.0, 0.0), (30.0, 11.0, 25.0)))
    assert aside["tail", "building"].distance_m == pytest.approx(0.3)
    below = found(thing((12.0, 9.0, 0.0), (14.0, 11.0, low_m - 1.2)))
    assert ("tail", "building") not in below
    assert below["below tail", "building"].distance_m == pytest.approx(1.2)
    trapped = found(thing((12.0, 9.0, 0.0), (14.0, 11.0, low_m - 0.3)))
    assert trapped["tail", "building"].distance_m == 0.0


def test_the_nearest_of_each_kind_is_named_and_a_limit_leaves_out_the_rest() -> None:
    far, near = thing((20.0, 9.0, 0.0), (21.0, 11.0, 5.0)), thing((15.0, 9.0, 0.0), (16.0, 11.0, 5.0))
    other = thing((12.0, 9.0, 0.0), (12.5, 11.0, 5.0), "structure")
    both = found(far, near, other)
    assert both["mast", "building"].distance_m == pytest.approx(4.2)
    assert both["mast", "structure"].distance_m == pytest.approx(1.2)
    assert ("mast", "building") not in found(far, near, most_m=4.0)


def test_outriggers_and_the_low_tail_of_a_mobile_crane() -> None:
    crane = MOBILE_CRANES[0]
    at_m = outline_of(crane).tail_m + 0.2
    near = found(thing((at_m, -1.0, 0.0), (at_m + 1.0, 1.0, 3.0)), crane=crane)
    assert near["tail", "building"].distance_m == pytest.approx(0.2)
    assert near["base", "building"].distance_m == pytest.approx(max(at_m - crane.mast_size_m / 2.0, 0.0))
    assert ("mast", "building") not in near
    low = found(thing((1.0, -1.0, 0.0), (2.0, 1.0, 0.2)), crane=crane)
    assert ("below tail", "building") not in low


def test_a_stated_area_is_the_foundation() -> None:
    assert base_of(CRANE).stated is False
    assert base_of(dataclasses.replace(CRANE, foundation_m2=36.0)) == (6.0, True)
    assert base_of(MOBILE_CRANES[0]).edge_m == MOBILE_CRANES[0].mast_size_m


def test_cells_of_an_obstruction_count_as_boxes() -> None:
    site = box_site([], obstructions=[("truck", (14.0, 9.0, 0.0), (15.0, 11.0, 3.0))], crane=CRANE)
    (near,) = (one for one in of_crane(CRANE, fixed_things(site)) if one.piece == "mast")
    assert (near.kind, near.name, near.distance_m) == ("obstruction", "truck", pytest.approx(3.2))


def test_the_boundary_of_the_plot_is_measured_from_inside() -> None:
    import shapely

    plot = {"boundary": shapely.box(0.0, 0.0, 40.0, 40.0)}
    near = {one.piece: one.distance_m for one in to_areas(CRANE, plot)}
    assert near["mast"] == pytest.approx(10.0 - 0.8)
    assert near["tail"] == pytest.approx(10.0 - outline_of(CRANE).tail_m)
    tight = {"boundary": shapely.box(5.0, 0.0, 40.0, 40.0)}
    assert {one.piece: one.distance_m for one in to_areas(CRANE, tight)}["tail"] < 0.0
    yard = {"yard": shapely.box(20.0, 0.0, 30.0, 10.0)}
    assert {one.piece for one in to_areas(CRANE, yard)} == {"mast", "base"}  # the tail is far above it


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.integers(-2000, 2000).map(lambda n: n / 100.0), min_size=9, max_size=9),
    st.floats(-5.0, 5.0),
    st.floats(0.5, 20.0),
)
def test_a_triangle_at_any_height_is_measured_as_dense_points_are(corners, low_m, high_m) -> None:
    from bimvox.site.crane_distances import _clipped

    triangle = np.array(corners).reshape(1, 3, 3)
    share = np.array([(a / 60, b / 60, 1 - (a + b) / 60) for a in range(61) for b in range(61 - a)])
    points = share @ triangle[0]
    level = points[(points[:, 2] > low_m + 1e-9) & (points[:, 2] < low_m + high_m - 1e-9)]
    shapes = _clipped(triangle, low_m, low_m + high_m)
    if not len(level):
        return
    import shapely

    (shape,) = shapes
    apart = shapely.distance(shape, shapely.points(level[:, :2]))
    assert apart.max() < 1e-6  # nothing that is level is left out
    origin = shapely.Point(0.0, 0.0)
    step_m = sqrt(((triangle[0] - np.roll(triangle[0], 1, axis=0)) ** 2).sum(axis=1).max()) / 30
    sampled = float(np.hypot(*level[:, :2].T).min())
    if len(level) > 200:
        assert shapely.distance(shape, origin) <= sampled + 1e-9
        assert shapely.distance(shape, origin) >= sampled - 3.0 * step_m
