"""What is near a hoist rope, counted in the columns around it."""

from dataclasses import replace

import numpy as np
import pytest
from box_sites import box_site, test_crane

from bimvox.bim.building import TriangleMesh
from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.proof.moment import Thing
from bimvox.proof.site_rules import _around_rope, _closes, check_rope_margin
from bimvox.records.proof import Check
from bimvox.site.site import Rules


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
