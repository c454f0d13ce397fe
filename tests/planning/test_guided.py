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
from bimvox.planning.planner import plan_lifts
from bimvox.planning.preparation import prepare
from bimvox.proof.footprint import CellMask, motion_footprint, path_footprint
from bimvox.proof.motion import verify_motions
from bimvox.proof.plan import verify_plan
from bimvox.records.guide import MOST_TILT_RAD
from bimvox.records.lift import Status
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
    return pairs, centre_m, find_guide(pairs, centre_m, (0.0,), 1.0, 0.3)


def test_a_way_that_led_one_part_in_leads_the_next_one_in_without_a_search(tight, monkeypatch):
    """From any height, and mirrored: what is to the east for the one is to the west for the other."""
    pairs, centre_m, found = tight
    monkeypatch.setattr(guided._Way, "out", lambda self: pytest.fail("searched for"))
    mirrored = tuple((height, -aside, -tilt) for height, aside, tilt in found.poses[1:])
    for known in (found.poses[1:], mirrored):
        again = find_guide(pairs, centre_m, (0.0,), 3.0, 0.3, [known])
        assert again.poses == ((3.0, 0.0, 0.0), *found.poses[1:])


def test_a_known_way_is_used_only_if_it_is_free_and_a_crew_can_hold_the_load_so(tight):
    pairs, centre_m, found = tight
    straight = [((0.1, 0.01, 0.0), (0.0, 0.0, 0.0))]
    assert find_guide(pairs, centre_m, (0.0,), 1.0, 0.3, straight) == found
    assert isinstance(find_guide(pairs, centre_m, (0.0,), 1.0, 0.03, [found.poses[1:]]), NoGuide)


def test_boxes_rule_out_only_poses_in_which_nothing_meets(tight):
    pairs, _, found = tight
    around = guided._Around(pairs, dataclasses.replace(found, poses=((1.0, 0.0, 0.0), (0.0, 0.0, 0.0))), 0.3)
    rng = np.random.default_rng(0)
    poses = rng.uniform((0.0, -0.3, -0.2), (1.0, 0.3, 0.2), (2000, 3))
    close = around._close(poses).any(axis=1)
    meets = np.array([around.meets(tuple(pose)) for pose in poses.tolist()])
    assert 100 < meets.sum() <= close.sum() < 1900
    assert close[meets].all()


@pytest.fixture
def heights(monkeypatch):
    """The heights from which guides are searched for."""
    found = []

    def searched(pairs, centre_m, headings_rad, top_m, *more):
        found.append(top_m)
        return find_guide(pairs, centre_m, headings_rad, top_m, *more)

    monkeypatch.setattr(insertion, "find_guide", searched)
    return found


def test_where_no_way_leads_out_of_a_pocket_none_is_searched_for_again_from_higher_up(heights):
    """With each clearance, the last moves begin at another height; the pocket stays the same."""
    site = slab_between_beams(-0.08, rules=Rules(transit_clearance_m=2.0, gives_way=("transit_clearance_m",)))
    plan = plan_lifts(site, prepare(site))
    assert plan.lifts[0].status is Status.INFEASIBLE
    assert heights == [3.0]


@pytest.mark.parametrize(("aside_m", "gone", "come"), [(-0.08, 1, 1), (0.0, 1, 2)])
def test_what_was_found_holds_until_something_comes_into_the_way_or_out_of_it(heights, aside_m, gone, come):
    """A thing beside the part, above its pocket, comes and goes: no way stays none, and a way stays one if it goes."""
    site = slab_between_beams(aside_m)
    beside = joined(site.frame, "box", ((9.6, 4.0, 6.0), (10.6, 5.0, 6.5)))
    site = dataclasses.replace(site, blockers=(*site.blockers, beside))
    component, occupancy = site.components[0], Occupancy(site)
    space = occupancy.space(component)

    def searches(contacts, *present_sets):
        heights.clear()
        for present in present_sets:
            find_insertion(PartToInsert(site, contacts, occupancy.counts, component, present, space, space))
        return len(heights)

    assert searches(Contacts(site), {1, 2, 3}, {1, 2}) == gone
    assert searches(Contacts(site), {1, 2}, {1, 2, 3}) == come
