"""What is near a hoist rope, counted in the columns around it."""

from __future__ import annotations

import dataclasses
from dataclasses import replace
from itertools import cycle
from pathlib import Path

import numpy as np
import pytest
from box_sites import box_site, test_crane
from hypothesis import example, given, settings
from hypothesis import strategies as st

import bimvox
from bimvox.bim.building import Role, TriangleMesh
from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.proof import site_rules
from bimvox.proof.moment import Thing
from bimvox.proof.site_rules import _around_rope, _closes, check_rope_margin, check_wind, first_of
from bimvox.records.proof import Check
from bimvox.site.parts import sail_area_m2
from bimvox.site.site import Rules, Site


@pytest.mark.parametrize("reach", [1, 2])
def test_what_is_near_a_rope_is_in_the_columns_around_it_above_the_hook(reach):
    rng = np.random.default_rng(3)
    counts = (rng.random((9, 8, 7)) < 0.02).astype(np.uint16)
    hooks = rng.integers(-3, 12, (400, 3))
    columns = np.pad(counts, ((20, 20), (20, 20), (0, 20)))
    wanted = [
        columns[x + 20 - reach : x + 21 + reach, y + 20 - reach : y + 21 + reach, max(z, 0) :].any()
        for x, y, z in hooks.tolist()
    ]
    found = _around_rope(counts, hooks, reach)
    assert found.tolist() == wanted
    assert 50 < found.sum() < 350


def test_a_surface_closes_if_every_edge_belongs_to_an_even_number_of_triangles():
    corners = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (-0.0, 0.0, -0.0)])
    faces = [(0, 2, 1), (4, 1, 3), (1, 2, 3), (0, 3, 2), (0, 4, 1)]  # the last one has no area: its edges cancel
    assert _closes(TriangleMesh(corners, np.array(faces[:4], np.int32)))
    assert not _closes(TriangleMesh(corners, np.array(faces[:3], np.int32)))
    assert _closes(TriangleMesh(corners, np.array(faces, np.int32)))


@pytest.mark.parametrize(
    ("moves", "good"),
    [
        ([(0, 0, 1)] * 4, True),
        ([(0, 0, 1), (0, 0, 1), (0, 0, -1), (0, 0, 1), (0, 0, 1)], False),
        ([(0, 0, 1), (0, 1, 0), (0, 0, 1)], False),
    ],
)
def test_a_rope_next_to_something_is_excused_only_while_the_load_goes_straight_up_from_the_yard(moves, good):
    block = ("block", (12.0, 4.0, 0.0), (13.0, 5.0, 1.0))
    site = box_site([block], crane=test_crane(), rules=Rules(rope_clearance_m=1.0))
    (part,) = site.components
    path = np.cumsum([part.target_vox, *moves], axis=0).astype(np.int32)
    counts = np.zeros(site.shape, np.uint16)
    x, y, _ = np.add(path[0], part.hook_offset_vox)
    counts[x + 1, y, :] = 1  # a mast next to the rope
    mast = Thing("mast", np.array([(x + 1, y, z) for z in range(site.shape[2])], np.int32), -1)
    check = Check("rope_margin")
    (lift,) = plan_lifts(site, prepare(site)).lifts
    check_rope_margin(check, site, replace(lift, path_vox=path), [mast], counts, len(path) - 1)
    assert check.passed == good, check.failures
    assert all(failure.endswith("its rope is nearer than 1 m to mast") for failure in check.failures)


def test_the_first_number_or_cell_is_written_without_the_brackets_of_an_array():
    assert first_of(np.array([17, 18])) == "17"
    assert first_of(np.array([48.25])) == "48.25"
    assert first_of(np.array([[3, 4, 5], [6, 7, 8]], np.int32)) == "(3, 4, 5)"
    assert first_of(np.array([], np.int64)) == first_of(np.zeros((0, 3))) == ""


SAMPLES = Path(__file__).parents[2] / "sample_models"


def site_in(wind_m_s: float) -> Site:
    crane = test_crane(base=(10.0, -3.0, 0.0), jib=40.0, height=14.0)
    return box_site([("part", (4.0, 4.0, 0.0), (5.0, 5.0, 1.0))], crane=crane, rules=Rules(wind_speed_m_s=wind_m_s))


SITES = {wind: site_in(wind) for wind in (0.5, 5.0, 9.8, 14.0, 20.0)}


def area_failures(mesh: TriangleMesh, wind_m_s: float) -> list[str]:
    """What the proof says of the area of a part of this shape, whose sail area is the planner's."""
    site, check = SITES[wind_m_s], Check("wind")
    part = dataclasses.replace(site.components[0], mesh=mesh, sail_area_m2=round(sail_area_m2(mesh), 6), mass_kg=1e6)
    check_wind(check, site, site.cranes[0], part)
    assert check.samples == 2
    return [failure for failure in check.failures if "shows the wind" in failure]


SPOTS = st.tuples(*[st.floats(-8.0, 8.0, allow_subnormal=False)] * 3)


@st.composite
def meshes(draw: st.DrawFn) -> TriangleMesh:
    """Any triangles: open sheets, crossing faces, doubled faces, slivers."""
    spots = draw(st.lists(SPOTS, min_size=3, max_size=9))
    corner = st.integers(0, len(spots) - 1)
    faces = draw(st.lists(st.tuples(corner, corner, corner), min_size=1, max_size=14))
    return TriangleMesh(np.array(spots), np.array(faces, np.int32))


SHEET = TriangleMesh(
    np.array([(0.0, 0.0, 0.0), (4.0, 0.0, 0.0), (4.0, 0.0, 3.0), (0.0, 0.0, 3.0)]), np.array([(0, 1, 2), (0, 2, 3)])
)


@settings(max_examples=60, deadline=None)
@given(meshes(), st.sampled_from(sorted(SITES)))
@example(SHEET, 9.8)
def test_no_shape_shows_more_than_its_sail_area(mesh: TriangleMesh, wind_m_s: float) -> None:
    assert area_failures(mesh, wind_m_s) == []


@pytest.mark.parametrize("sample", ["frame", "prefab"])
def test_the_area_of_every_part_of_a_sample_is_proven_at_any_wind(sample: str) -> None:
    parts = [one for one in bimvox.read(SAMPLES / f"{sample}.ifc").elements if one.role is Role.COMPONENT]
    assert parts
    for part, wind_m_s in zip(parts, cycle(SITES), strict=False):
        assert area_failures(part.mesh, wind_m_s) == []


def test_a_single_sheet_shows_all_of_its_area() -> None:
    assert sail_area_m2(SHEET) == pytest.approx(12.0)


@settings(max_examples=25, deadline=None)
@given(st.lists(st.tuples(SPOTS, st.tuples(*[st.floats(0.05, 4.0)] * 3)), min_size=1, max_size=3))
def test_closed_boxes_count_no_more_than_their_faces(boxes: list[tuple[tuple[float, ...], tuple[float, ...]]]) -> None:
    """Not the sum of both sides: half of the closed surface covers the outline."""
    solids = [box_surface(np.array(low), np.array(low) + np.array(size)) for low, size in boxes]
    vertices = np.concatenate([vertices for vertices, _ in solids])
    faces = np.concatenate([faces + 8 * n for n, (_, faces) in enumerate(solids)])
    area_m2 = sail_area_m2(TriangleMesh(vertices, faces))
    most = sum(size[2] * np.hypot(size[0], size[1]) for _, size in boxes)
    assert area_m2 <= most + 1e-9


def box_surface(low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return corners and outward triangles of a box."""
    corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return corners, np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])


def test_the_area_of_a_part_is_measured_once_for_all_its_proofs(monkeypatch: pytest.MonkeyPatch) -> None:
    box = TriangleMesh(SHEET.vertices_m + 1.0, SHEET.faces)
    views = []
    monkeypatch.setattr(site_rules, "_hull_m2", lambda flat: views.append(flat) or 0.0)
    for _ in range(3):
        assert area_failures(box, 9.8) == []
    assert len(views) == 12
