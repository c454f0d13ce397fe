"""Parts that only get to their places aside and tilted."""

import dataclasses

import numpy as np
import pytest
from guided_sites import joined, slab_between_beams
from planned_sites import planned

from bimvox.log.plan_json import plan_from_json, plan_to_json
from bimvox.log.track import crane_track
from bimvox.planning import guided, insertion
from bimvox.planning.assembly import Assembly
from bimvox.planning.contact.pairs import Contacts
from bimvox.planning.guided import NoGuide, Pair, find_guide
from bimvox.planning.insertion import PartToInsert, find_insertion
from bimvox.planning.occupancy import Occupancy
from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.proof.footprint import CellMask, motion_footprint, path_footprint
from bimvox.proof.motion import verify_motions
from bimvox.proof.plan import verify_plan
from bimvox.records.lift import MOST_TILT_RAD, Status
from bimvox.site.parts import centre_of_mass_m
from bimvox.site.site import Rules
from bimvox.stop.redirect import Redirected, UnderWay, redirect


@pytest.fixture(scope="module")
def done():
    return planned(slab_between_beams())


def test_a_slab_goes_in_under_the_flanges_with_one_end_first(done):
    plan, motions = done
    (lift,) = plan.lifts
    assert lift.status is Status.PLANNED, lift.reason
    assert lift.guide is not None
    assert 0.01 < lift.guide.steepest_rad <= MOST_TILT_RAD
    assert lift.guide.furthest_m >= 0.05
    assert lift.guide.top_m == pytest.approx(0.5 * lift.contact_moves)
    assert verify_plan(plan).failures == ()
    assert verify_motions(plan, motions).failures == ()


def test_what_hangs_on_the_hook_is_shown_as_it_is_guided(done):
    plan, motions = done
    track = crane_track(plan.site, plan.lifts[0], motions[0])
    tilt_rad = 2.0 * np.arcsin(np.linalg.norm(track.tilt[:, :3], axis=1))
    assert tilt_rad.max() == pytest.approx(plan.lifts[0].guide.steepest_rad, abs=2e-3)
    assert tilt_rad[0] == tilt_rad[-1] == 0.0
    assert np.ptp(track.corner_m[-40:, 0]) > 0.04
    place_m = plan.site.frame.corner_of(plan.site.components[0].target_vox)
    assert track.corner_m[-1] == pytest.approx(place_m, abs=1e-6)


def test_a_crew_has_time_for_it(done):
    _, motions = done
    lowered = motions[0].loaded
    straight = planned(slab_between_beams(aside_m=0.5))[1][0].loaded
    assert lowered.duration_s > straight.duration_s + 5.0


def test_flanges_that_leave_room_need_no_crew():
    plan, _ = planned(slab_between_beams(aside_m=0.5))
    assert plan.lifts[0].guide is None or plan.lifts[0].guide.steepest_rad == 0.0


def test_an_obstruction_where_it_would_be_guided_stops_it():
    site = slab_between_beams(obstructions=[("cable", (6.0, 4.0, 4.0), (6.5, 4.5, 4.5))])
    plan = plan_lifts(site, prepare(site))
    assert plan.lifts[0].status is Status.INFEASIBLE


def test_what_gets_in_the_way_of_the_guided_load_alone_is_noticed(done):
    """A cell beside all cells of the level load: only held aside does it come there."""
    plan, motions = done
    site, lift = plan.site, plan.lifts[0]
    x, y, z = site.components[0].target_vox
    cable, far = (CellMask(site.shape) for _ in range(2))
    cable.add(np.array([[x - 1, y, z + 1]], np.int32))
    far.add(np.array([[x - 4, y, z + 1]], np.int32))
    for footprint in (path_footprint(site, lift), motion_footprint(site, lift, motions[0]).carrying):
        assert cable.meets(footprint)
        assert not far.meets(footprint)


def test_a_stopped_load_is_guided_on_its_new_path(done):
    plan, motions = done
    site, lift = plan.site, plan.lifts[0]
    crane, moving = site.cranes[0], motions[0]
    assembly = Assembly(site, prepare(site))
    rule, blocked = assembly.on_the_way(0, lift.last_moves_vox)
    now_ns = moving.start_ns + int(moving.loaded.time_ns[len(moving.loaded.time_ns) // 3])
    found = redirect(site, crane, UnderWay(lift, moving, None), rule, blocked, now_ns, 5.0)
    assert isinstance(found, Redirected)
    assert found.lift.guide == lift.guide == found.lift.left[0].guide
    other = dataclasses.replace(plan, lifts=(found.lift,))
    assert verify_plan(other).failures == ()
    assert verify_motions(other, (found.motion,)).failures == ()
    text = plan_to_json(other)
    read, _ = plan_from_json(text, site, {0: found.lift.path_vox}, "log")
    assert read.lifts[0].left[0].guide == lift.guide


@pytest.fixture(scope="module")
def tight():
    """What the slab must not meet, its centre, and the way to its place; one beam is nearer than the other."""
    site = slab_between_beams(-0.02)
    contacts = prepare(site).contacts
    pairs = [Pair(*contacts.pair_m(0, number), np.zeros(3)) for number in (1, 2)]
    centre_m = centre_of_mass_m(site.components[0].mesh)
    part_m = contacts.triangles_m(0)
    return part_m, pairs, centre_m, find_guide(part_m, pairs, centre_m, (0.0,), 1.0, 0.3)


def test_a_guide_is_no_further_aside_than_a_crew_can_hold_the_load(tight):
    part_m, pairs, centre_m, found = tight
    assert found.furthest_m > 0.03
    assert isinstance(find_guide(part_m, pairs, centre_m, (0.0,), 1.0, 0.03), NoGuide)


def test_from_higher_up_the_same_poses_lead_in(tight):
    part_m, pairs, centre_m, found = tight
    again = find_guide(part_m, pairs, centre_m, (0.0,), 3.0, 0.3)
    assert again.poses == ((3.0, 0.0, 0.0), *found.poses[1:])


def test_a_search_ends_after_a_counted_amount_of_work(tight):
    """It is then not known whether there is a way, from whatever height."""
    part_m, pairs, centre_m, found = tight
    assert find_guide(part_m, pairs, centre_m, (0.0,), 1.0, 0.3, 10**9) == found
    assert find_guide(part_m, pairs, centre_m, (0.0,), 1.0, 0.3, 1000) == NoGuide(1.0, np.inf)
    around = guided._Around(part_m, pairs, found, 0.3)
    _, _, work = around.way_out(0.02, 1000)
    assert 1000 <= work < 5000


@pytest.mark.parametrize("many", [30, 3000])
def test_a_way_of_many_poses_is_shortened_in_few_tests(tight, monkeypatch, many):
    part_m, pairs, _, found = tight
    around = guided._Around(part_m, pairs, found, 0.3)
    tests = []
    monkeypatch.setattr(around, "is_free", lambda a, b: tests.append(b) or (a[0] < 1.0) == (b[0] <= 1.0))
    way = [(2.0 * n / many, 0.0, 0.0) for n in range(many + 1)]
    assert len(around.shortened(way)) == 3 + (len(way) % 2 == 0)
    assert len(tests) <= 4 * np.log2(many)


@pytest.fixture
def heights(monkeypatch):
    """The heights from which guides are searched for."""
    found = []

    def searched(part_m, pairs, centre_m, headings_rad, top_m, *more):
        found.append(top_m)
        return find_guide(part_m, pairs, centre_m, headings_rad, top_m, *more)

    monkeypatch.setattr(insertion, "find_guide", searched)
    return found


def test_where_no_way_leads_out_of_a_pocket_none_is_searched_for_again_from_higher_up(heights):
    """With each clearance, the last moves begin at another height; the pocket stays the same."""
    site = slab_between_beams(-0.08, rules=Rules(transit_clearance_m=2.0, gives_way=("transit_clearance_m",)))
    plan = plan_lifts(site, prepare(site))
    assert plan.lifts[0].status is Status.INFEASIBLE
    assert heights == [3.0]


@pytest.mark.parametrize(
    ("aside_m", "beside_m", "gone", "come"),
    [(-0.08, 6.0, 1, 1), (0.0, 6.0, 1, 1), (-0.08, 3.5, 2, 1), (0.0, 4.0, 2, 2)],
)
def test_what_was_found_holds_until_something_comes_into_the_way_or_out_of_it(heights, aside_m, beside_m, gone, come):
    """A thing comes and goes that is beside the part, above all its ways or not.

    No way stays none if something comes. Another guide may be found if something goes, so it is searched for.
    """
    site = slab_between_beams(aside_m)
    beside = joined(site.frame, "box", ((9.6, 4.0, beside_m), (10.6, 5.0, beside_m + 0.5)))
    site = dataclasses.replace(site, blockers=(*site.blockers, beside))
    component, occupancy = site.components[0], Occupancy(site)
    space = occupancy.space(component)

    def guide(contacts, present):
        part = PartToInsert(site, contacts, occupancy.counts, component, present, space, space)
        return getattr(find_insertion(part), "guide", None)

    for first, second, searches in (({1, 2, 3}, {1, 2}, gone), ({1, 2}, {1, 2, 3}, come)):
        heights.clear()
        contacts = Contacts(site)
        in_a_row = [guide(contacts, present) for present in (first, second, first)]
        assert len(heights) == searches
        assert in_a_row == [guide(Contacts(site), present) for present in (first, second, first)]
