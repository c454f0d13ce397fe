import itertools
from dataclasses import replace

import numpy as np
import pytest
from box_sites import box_site, test_crane
from hypothesis import given
from hypothesis import strategies as st

from bimvox.crane.travel import Travel
from bimvox.planning.best_place import BestPlace, Clearance, counts
from bimvox.site.component import StoredPose

SLAB, POST = ("slab", (2.0, 3.0, 0.0), (5.0, 4.0, 0.5)), ("post", (8.0, 12.0, 0.0), (9.0, 13.0, 2.0))
YARD = ((22.0, 0.0), (40.0, 30.0))
CRANE = test_crane(base=(6.0, 6.0, 0.0))
LYING = ((StoredPose.AS_BUILT, 0),)
AT_ITS_HEADING = Clearance(0, turns=False)


def best_of(site, free, *, before=None, lyings=LYING, clearance=AT_ITS_HEADING, tops=None, travels=None):
    tops = np.zeros(site.shape[:2], np.int32) if tops is None else tops
    travels = [Travel(crane, 60.0) for crane in site.cranes] if travels is None else travels
    return BestPlace(site, tops, travels).of(site.components[0], free, lyings, clearance, before)


def seconds_at(site, travel, cell, before):
    """Return the travel time with the slab at a cell, by ``Travel`` alone."""
    size_m, origin_m = site.frame.voxel_size_m, np.array(site.frame.origin_m)

    def axes(hook_vox):
        return travel.axes_of(origin_m + size_m * (np.array(hook_vox) + np.array([0.5, 0.5, 0.0])))

    part = site.components[0]
    hook = axes((*np.add(cell[:2], part.hook_offset_vox[:2]), part.shape.size_vox[2] + 2))
    ends = [axes(np.add(one.target_vox, one.hook_line_vox)) for one in (part, *([] if before is None else [before]))]
    return sum(float(travel.between_s(hook, end)) for end in ends)


def taken_at_random(site, seed, share):
    return site.yard & (np.random.default_rng(seed).random(site.shape[:2]) > share)


@given(st.integers(0, 10_000), st.floats(0.0, 0.3), st.booleans())
def test_no_free_place_has_less_travel_time_and_of_equal_ones_it_is_the_first(seed, share, is_first):
    site = box_site([SLAB, POST], yard=YARD, crane=CRANE)
    travel, before = Travel(CRANE, 60.0), None if is_first else site.components[1]
    free = taken_at_random(site, seed, share)
    size_x, size_y, _ = site.components[0].shape.size_vox
    nx, ny, _ = site.shape
    corners = itertools.product(range(ny - size_y + 1), range(nx - size_x + 1))
    rated = [
        (seconds_at(site, travel, (x, y), before) // 2.0, y, x)
        for y, x in corners
        if free[x : x + size_x, y : y + size_y].all()
    ]
    found = best_of(site, free, before=before)
    assert found == (None if not rated else (LYING[0], (min(rated)[2], min(rated)[1], 1)))


def test_without_travel_times_it_is_the_first_free_place():
    site = box_site([SLAB], yard=YARD)
    free = site.yard.copy()
    free[:, :7] = False
    _, cell = best_of(site, free, travels=[])
    assert cell == (int(np.argmax(site.yard.any(axis=1))), 7, 1)


def test_a_place_out_of_the_cranes_reach_is_none():
    site = box_site([SLAB], yard=YARD, crane=replace(CRANE, jib_length_m=4.0))
    assert best_of(site, site.yard) is None


def test_it_lies_in_the_next_way_only_if_it_does_not_fit_in_the_one_before():
    site = box_site([SLAB], yard=YARD, crane=CRANE)
    lyings = ((StoredPose.AS_BUILT, 0), (StoredPose.AS_BUILT, 1))
    assert best_of(site, site.yard, lyings=lyings)[0] == lyings[0]
    narrow = np.zeros_like(site.yard)
    narrow[30:32, 10:20] = True
    assert best_of(site, narrow, lyings=lyings)[0] == lyings[1]


def test_what_is_too_high_within_its_border_keeps_a_part_away():
    site = box_site([SLAB], yard=YARD, crane=CRANE)
    free, tops = np.zeros_like(site.yard), np.zeros(site.shape[:2], np.int32)
    free[24:36, 10:25] = True
    _, (x, y, _) = best_of(site, free)
    tops[x - 2, y] = site.shape[2]
    assert best_of(site, free, tops=tops, clearance=Clearance(1, turns=False))[1] == (x, y, 1)
    _, (other_x, other_y, _) = best_of(site, free, tops=tops, clearance=Clearance(3, turns=False))
    assert (other_x, other_y) != (x, y)
    assert max(abs(other_x - (x - 2)), abs(other_y - y)) > 3


def test_of_two_cranes_each_picks_in_its_own_columns_if_there_is_room():
    cranes = tuple(replace(test_crane(base=(6.0, y_m, 0.0)), name=f"at {y_m}") for y_m in (2.0, 13.0))
    site = replace(box_site([SLAB], yard=YARD), cranes=cranes)
    for number in (0, 1):
        here = replace(site, components=(replace(site.components[0], crane=number),))
        _, (_, y, _) = best_of(here, site.yard)
        hook_y = y + site.components[0].hook_offset_vox[1]
        assert (hook_y < 15) == (number == 0)
        others = site.yard.copy()
        others[:, slice(0, 16) if number == 0 else slice(13, None)] = False
        assert best_of(here, others) is not None


@pytest.mark.parametrize("seed", range(3))
def test_counts_add_up_every_rectangle(seed):
    columns = np.random.default_rng(seed).random((6, 5)) < 0.4
    table = counts(columns)
    for x0, x1, y0, y1 in itertools.product(range(7), range(7), range(6), range(6)):
        if x0 <= x1 and y0 <= y1:
            assert table[x1, y1] - table[x0, y1] - table[x1, y0] + table[x0, y0] == columns[x0:x1, y0:y1].sum()
