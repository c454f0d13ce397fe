"""The proof's measure of overlap: boxes against interval arithmetic; thin, hollow, turned and open parts."""

import numpy as np
import pytest
from box_sites import box_mesh
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from bimvox.bim.building import TriangleMesh
from bimvox.proof.bodies.overlap import overlaps_m
from bimvox.proof.bodies.solid import FINEST_M, is_inside, solid_of

TOLERANCE_M = 0.010
CUBE = ((0.0, 0.0, 0.0), (1.0, 1.0, 1.0))


def joined(*meshes):
    starts = np.cumsum([0, *(len(mesh.vertices_m) for mesh in meshes)])
    faces = np.concatenate([mesh.faces + start for mesh, start in zip(meshes, starts, strict=False)])
    return TriangleMesh(np.concatenate([mesh.vertices_m for mesh in meshes]), faces.astype(np.int32))


def turned(mesh, rad):
    c, s = np.cos(rad), np.sin(rad)
    return TriangleMesh(mesh.vertices_m @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]), mesh.faces)


def pair(one, other):
    """Return two meshes as solids, the thicker one first."""
    solids = [solid_of(mesh, TOLERANCE_M) for mesh in (one, other)]
    return sorted(solids, key=lambda solid: -solid.thickness_m)


def deep(one, other):
    """Return whether two meshes overlap deeper than allowed."""
    return bool(np.isfinite(overlaps_m(*pair(one, other), np.zeros((1, 3)))).all())


@pytest.mark.parametrize(("sunk_m", "expected"), [(-0.5, False), (0.0, False), (0.0098, False), (0.0105, True)])
@pytest.mark.parametrize("rad", [0.0, 0.3])
def test_a_part_may_sink_by_the_tolerance(sunk_m, expected, rad):
    wall = box_mesh((0.2, -1.0, 1.0 - sunk_m), (0.4, 2.0, 3.0))
    assert deep(turned(box_mesh(*CUBE), rad), turned(wall, rad)) is expected
    equal = box_mesh((0.0, 0.0, 1.0 - sunk_m), (1.0, 1.0, 2.0 - sunk_m))
    assert deep(turned(box_mesh(*CUBE), rad), turned(equal, rad)) is expected


def test_the_point_that_is_returned_is_in_both():
    thick, thin = pair(box_mesh(*CUBE), box_mesh((0.4, 0.4, 0.9), (0.6, 0.6, 3.0)))
    offset_m = np.array([0.0, 0.0, -0.02])
    (point_m,) = overlaps_m(thick, thin, offset_m[None])
    assert np.isfinite(point_m).all()
    assert TOLERANCE_M < 1.0 - point_m[2] <= 0.12
    assert is_inside(thick, point_m)


sizes = st.tuples(*[st.floats(0.05, 1.0)] * 3)
places = st.tuples(*[st.floats(-1.0, 1.0)] * 3)


@settings(max_examples=300, deadline=None)
@given(sizes, sizes, places)
def test_boxes_overlap_as_intervals_do(size, other_size, place):
    """One box is deeper than the tolerance in another if three intervals overlap after shrinking."""
    low, high = np.array(place), np.array(place) + other_size
    one, other = box_mesh((0.0, 0.0, 0.0), size), box_mesh(low, high)
    thick, thin = pair(one, other)
    core_low, core_high = thick.corners_m.min(axis=(0, 1)) + TOLERANCE_M, thick.corners_m.max(axis=(0, 1)) - TOLERANCE_M
    margins = np.minimum(core_high - thin.corners_m.min(axis=(0, 1)), thin.corners_m.max(axis=(0, 1)) - core_low)
    assume(np.abs(margins.min()) > 2.0 * FINEST_M)
    assert np.isfinite(overlaps_m(thick, thin, np.zeros((1, 3)))).all() == (margins.min() > 0.0)


def test_a_tongue_may_overlap_both_sides_of_its_groove():
    groove = joined(box_mesh((0, 0, 0), (3, 1, 1)), box_mesh((0, 0, 1), (1, 1, 2)), box_mesh((2, 0, 1), (3, 1, 2)))
    for overlap, expected in ((0.009, False), (0.012, True)):
        tongue = box_mesh((1.0 - overlap, 0.2, 1.0 - overlap), (2.0 + overlap, 0.8, 4.0))
        assert deep(groove, tongue) is expected


@pytest.mark.parametrize("thickness_m", [0.002, 0.006, 0.012])
def test_nothing_passes_through_a_thin_part(thickness_m):
    sheet = box_mesh((0.0, 0.0, 0.0), (1.0, 1.0, thickness_m))
    for other in (
        box_mesh((0.4, 0.4, -0.5), (0.6, 0.6, 0.5)),  # a post through it
        box_mesh((0.5, -0.5, -0.5), (0.5 + thickness_m, 1.5, 0.5)),  # a sheet across it
        box_mesh((0.5, 0.0, 0.0), (1.5, 1.0, thickness_m)),  # the same sheet, half way across
        box_mesh((-1.0, -1.0, -1.0), (2.0, 2.0, 2.0)),  # a block around it
    ):
        assert deep(sheet, other)
    assert not deep(sheet, box_mesh((0.4, 0.4, thickness_m), (0.6, 0.6, 0.5)))
    assert not deep(sheet, box_mesh((1.0, 0.0, 0.0), (2.0, 1.0, thickness_m)))


def test_the_web_of_a_profile_is_not_a_gap_under_its_thicker_flanges():
    web = box_mesh((0.0, -0.003, 0.02), (4.0, 0.003, 0.28))
    profile = joined(box_mesh((0, -0.1, 0), (4, 0.1, 0.02)), web, box_mesh((0, -0.1, 0.28), (4, 0.1, 0.3)))
    assert deep(profile, box_mesh((1.0, -0.02, 0.1), (1.2, 0.02, 0.2)))
    assert not deep(profile, box_mesh((1.0, 0.003, 0.1), (1.2, 0.09, 0.2)))


def test_a_small_part_inside_a_large_one_and_a_duplicate_are_found():
    assert deep(box_mesh(*CUBE), box_mesh((0.4, 0.4, 0.4), (0.6, 0.6, 0.6)))
    assert deep(box_mesh(*CUBE), box_mesh((0.0, 0.0, 0.0), (0.2, 0.2, 0.2)))
    assert deep(box_mesh(*CUBE), box_mesh(*CUBE))


def test_parts_drawn_badly_still_have_an_inside():
    block, post = box_mesh(*CUBE), box_mesh((0.4, 0.4, 0.9), (0.6, 0.6, 3.0))
    inverted = TriangleMesh(block.vertices_m, block.faces[:, ::-1].copy())
    mixed = TriangleMesh(block.vertices_m, np.where(np.arange(12)[:, None] % 3, block.faces, block.faces[:, ::-1]))
    lidless = TriangleMesh(block.vertices_m, block.faces[2:])
    twice = joined(block, block)
    layers = joined(box_mesh((0, 0, 0), (1, 1, 0.5)), box_mesh((0, 0, 0.5), (1, 1, 1)))
    for drawn in (inverted, mixed, lidless, twice, layers):
        assert deep(drawn, post)
        assert not deep(drawn, box_mesh((0.4, 0.4, 1.0), (0.6, 0.6, 3.0)))
        assert not deep(drawn, box_mesh((1.0, 0.4, 0.4), (3.0, 0.6, 0.6)))


def test_a_corner_into_a_notch_may_overlap_both_its_faces():
    notched = joined(box_mesh((0, 0, 0), (2, 1, 1)), box_mesh((0, 0, 1), (1, 1, 2)))
    assert not deep(notched, box_mesh((0.991, 0.2, 0.991), (1.6, 0.8, 1.7)))
    assert deep(notched, box_mesh((0.991, 0.2, 0.980), (1.6, 0.8, 1.7)))


def test_skins_follow_the_thickness_under_each_triangle():
    solid = solid_of(joined(box_mesh(*CUBE), box_mesh((3, 0, 0), (4, 1, 0.01))), TOLERANCE_M)
    plate = solid.corners_m[:, :, 0].min(axis=1) >= 3.0
    flat = np.abs(solid.normals[:, 2]) > 0.5
    assert solid.skins_m[~plate] == pytest.approx(TOLERANCE_M, abs=1e-5)
    assert solid.skins_m[plate & flat] == pytest.approx(0.0045, abs=1e-5)
    assert solid.skins_m[plate & ~flat] == pytest.approx(TOLERANCE_M, abs=1e-5)


def test_positions_searched_together_are_as_each_alone():
    """Checked on random paths past, into and through parts, with skins of several depths."""
    rng = np.random.default_rng(7)
    profile = joined(
        box_mesh((0, -0.1, 0), (2, 0.1, 0.01)),
        box_mesh((0, -0.003, 0.01), (2, 0.003, 0.29)),
        box_mesh((0, -0.1, 0.29), (2, 0.1, 0.3)),
    )
    seen = set()
    for other in (box_mesh(*CUBE), turned(box_mesh((0.0, 0.0, 0.3), (1.0, 0.2, 0.5)), 0.2)):
        thick, thin = pair(profile, other)
        for _ in range(30):
            ends = rng.normal(0.0, 0.3, (2, 3)) * rng.integers(0, 2, 3) + rng.normal(0.0, 0.005, 3)
            way = ends[0] + np.linspace(0.0, 1.0, 23)[:, None] * (ends[1] - ends[0])
            together = np.isfinite(overlaps_m(thick, thin, way)[:, 0])
            alone = [np.isfinite(overlaps_m(thick, thin, offset[None])).all() for offset in way]
            assert together.tolist() == alone
            seen |= set(alone)
    assert seen == {True, False}


def pane(*corners):
    return TriangleMesh(np.array(corners, np.float64), np.array([[0, 1, 2], [0, 2, 3]], np.int32))


PANES = {
    "upright": pane((1.2, -1.0, 0.1), (1.2, 2.0, 0.1), (1.2, 2.0, 3.0), (1.2, -1.0, 3.0)),
    "leaning": pane((1.1, -1.0, 0.1), (1.1, 2.0, 0.1), (1.5, 2.0, 3.0), (1.5, -1.0, 3.0)),
    "level": pane((-1.0, -1.0, 1.3), (1.05, -1.0, 1.3), (1.05, 3.0, 1.3), (-1.0, 3.0, 1.3)),
}
"""Single faces next to the cube, such as the glass of a railing: they bound nothing."""


@pytest.mark.parametrize("names", [["upright"], ["level"], ["upright", "level"], ["leaning", "level"]])
def test_a_flat_sheet_of_a_part_has_no_inside(names):
    """A ray that goes out through a pane would take what is next to the part for its inside."""
    railed = solid_of(joined(box_mesh(*CUBE), *(PANES[name] for name in names)), TOLERANCE_M)
    points = np.random.default_rng(1).uniform(-0.9, 1.9, (300, 3))
    for point in points:
        in_cube = bool((point > 0.0).all() and (point < 1.0).all())
        assert is_inside(railed, point) is in_cube, point
    outside = solid_of(box_mesh((-0.5, -0.5, 1.05), (1.05, 0.5, 1.1)), TOLERANCE_M)
    assert np.isnan(overlaps_m(railed, outside, np.zeros((1, 3)))).all()
    inside = solid_of(box_mesh((0.4, 0.4, 0.9), (0.6, 0.6, 1.1)), TOLERANCE_M)
    assert np.isfinite(overlaps_m(railed, inside, np.zeros((1, 3)))).all()


@pytest.mark.parametrize("gap_m", [1e-5, 1e-3, 5e-3])
def test_faces_with_gaps_between_them_still_bound_a_body(gap_m):
    cube = box_mesh(*CUBE)
    faces = [cube.faces[n : n + 2] for n in range(0, 12, 2)]
    middle = np.array([0.5, 0.5, 0.5])
    shrunk = 1.0 - 2.0 * gap_m
    loose = []
    for face in faces:
        centre = cube.vertices_m[np.unique(face)].mean(axis=0)
        loose.append(
            TriangleMesh((cube.vertices_m[face.ravel()] - centre) * shrunk + centre, np.arange(6).reshape(2, 3))
        )
    assert is_inside(solid_of(joined(*loose), TOLERANCE_M), middle)
