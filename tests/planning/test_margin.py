import dataclasses

from box_sites import box_cells, box_site, test_crane
from named_cranes import default_luffing_crane
from planned_sites import PORTAL

from bimvox.crane.kinematics import with_luffing_jib
from bimvox.motion.time_plan import time_plan
from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.proof.motion import verify_motions
from bimvox.proof.plan import verify_plan
from bimvox.records.lift import Status
from bimvox.site.default_rules import ALL_KEPT, Kept
from bimvox.site.site import Blocker, Rules

PARTS = [
    ("left", (2.0, 2.0, 0.0), (2.5, 6.0, 3.0)),
    ("right", (5.0, 2.0, 0.0), (5.5, 6.0, 3.0)),
    ("slab", (2.0, 2.0, 3.02), (5.5, 6.0, 3.3)),
]
WALL = ("wall", (8.0, 0.0, 0.0), (8.5, 9.0, 3.0))


def planned(margin_m, **more):
    rules = Rules(rope="crane" in more, transit_clearance_m=margin_m)
    site = box_site(PARTS, structure=[WALL], rules=rules, **more)
    preparation = prepare(site)
    return site, preparation, plan_lifts(site, preparation)


def test_a_part_in_transit_keeps_its_distance_and_the_verifier_checks_it():
    for margin_m in (0.0, 0.5, 1.0):
        site, _, plan = planned(margin_m)
        assert [lift.status for lift in plan.lifts] == [Status.PLANNED] * 3
        assert verify_plan(plan).verified
        stricter = dataclasses.replace(site, rules=dataclasses.replace(site.rules, transit_clearance_m=margin_m + 1.0))
        proof = verify_plan(dataclasses.replace(plan, site=stricter))
        assert {check.name for check in proof.checks if not check.passed} == {"margin"}


def test_the_path_is_longer_with_a_margin():
    moves = [sum(lift.moves for lift in planned(margin_m)[2].lifts) for margin_m in (0.0, 1.0)]
    assert moves[0] < moves[1]


def test_the_crane_drives_a_path_with_a_margin():
    _, preparation, plan = planned(0.5, crane=test_crane(base=(13.0, 13.0, 0.0)))
    assert [lift.status for lift in plan.lifts] == [Status.PLANNED] * 3
    assert verify_plan(plan).verified
    motions = time_plan(plan, preparation)
    assert verify_motions(plan, motions).verified


def test_no_room_above_the_yard_is_named():
    parts = [("a", (2.0, 2.0, 0.0), (3.0, 3.0, 1.0), {"start_vox": (22, 5, 1)})]
    posts = [("post", (12.0, 2.5, 0.0), (12.5, 4.0, 9.5)), ("other", (10.0, 2.5, 0.0), (10.5, 4.0, 9.5))]
    site = box_site(parts, structure=posts, rules=Rules(rope=False, transit_clearance_m=0.5))
    lift = plan_lifts(site, prepare(site)).lifts[0]
    assert lift.status is Status.INFEASIBLE
    assert "less than 0.5 m clearance" in lift.reason
    assert "post" in lift.blocked_by


def test_a_clearance_of_the_site_file_that_leaves_no_path_is_named():
    walls = [("north", (8.0, 8.0, 0.0), (8.5, 15.0, 9.5)), ("south", (8.0, 0.0, 0.0), (8.5, 6.0, 9.5))]
    parts = [("a", (2.0, 2.0, 0.0), (3.0, 3.0, 1.0))]
    reasons = []
    for margin_m in (1.0, 0.5):
        site = box_site(parts, structure=walls, rules=Rules(rope=False, transit_clearance_m=margin_m))
        reasons.append(plan_lifts(site, prepare(site)).lifts[0].reason)
    assert reasons[0].endswith("with less than 1 m of [rules] transit_clearance_m a path does")
    assert reasons[1] is None


def test_a_policys_path_without_the_margin_is_not_taken():
    site, preparation, _ = planned(1.0)
    _, _, close = planned(0.0)
    paths = {tuple(lift.path_vox[-1]): lift.path_vox for lift in close.lifts}

    def propose(transit):
        return paths.get(transit.goal_vox)

    plan = plan_lifts(site, preparation, propose=propose)
    assert verify_plan(plan).verified


GIVES_WAY = Rules(rope=False, transit_clearance_m=0.5, gives_way=("transit_clearance_m",))
SHAFT = [
    ("west", (12.0, 2.5, 0.0), (12.5, 4.0, 9.5)),
    ("east", (10.0, 2.5, 0.0), (10.5, 4.0, 9.5)),
    ("north", (8.0, 8.0, 0.0), (8.5, 9.0, 3.0)),
]


def narrow(rules: Rules):
    """A part that leaves the yard between two posts 1.5 m apart that are as high as the site."""
    parts = [
        ("a", (2.0, 2.0, 0.0), (3.0, 3.0, 1.0), {"start_vox": (22, 5, 1)}),
        ("b", (5.0, 2.0, 0.0), (6.0, 3.0, 1.0)),
    ]
    return box_site(parts, structure=SHAFT, rules=rules)


def test_a_lift_keeps_what_it_can_of_a_default():
    site = narrow(GIVES_WAY)
    tight, free = sorted(plan_lifts(site, prepare(site)).lifts, key=lambda lift: lift.component)
    assert (tight.status, tight.clearance_m) == (Status.PLANNED, 0.0)
    assert (free.status, free.clearance_m) == (Status.PLANNED, None)
    plan = plan_lifts(site, prepare(site))
    assert verify_plan(plan).verified
    assert [failure for failure in verify_plan(without(plan, "clearance_m")).failures if "a:" in failure]


def without(plan, name):
    """The plan whose lifts claim to keep everything."""
    return dataclasses.replace(plan, lifts=tuple(dataclasses.replace(lift, **{name: None}) for lift in plan.lifts))


def test_a_value_of_the_site_file_does_not_give_way():
    hard = dataclasses.replace(GIVES_WAY, gives_way=())
    lifts = plan_lifts(narrow(hard), prepare(narrow(hard))).lifts
    tight = next(lift for lift in lifts if lift.component == 0)
    assert tight.status is Status.INFEASIBLE
    assert "less than 0.5 m clearance" in tight.reason
    plan = plan_lifts(narrow(GIVES_WAY), prepare(narrow(GIVES_WAY)))
    proof = verify_plan(dataclasses.replace(plan, site=narrow(hard)))
    assert {check.name for check in proof.checks if not check.passed} == {"margin"}


def test_a_part_that_has_no_way_at_all_is_not_blamed_on_the_clearance():
    parts = [("a", (2.0, 2.0, 0.0), (3.0, 3.0, 1.0))]
    lid = ("lid", (1.0, 1.0, 2.0), (4.0, 4.0, 2.5))
    walls = [
        (f"wall {n}", low, high)
        for n, (low, high) in enumerate(
            [
                ((1.0, 1.0, 0.0), (1.5, 4.0, 2.0)),
                ((3.5, 1.0, 0.0), (4.0, 4.0, 2.0)),
                ((1.5, 1.0, 0.0), (3.5, 1.5, 2.0)),
                ((1.5, 3.5, 0.0), (3.5, 4.0, 2.0)),
            ]
        )
    ]
    site = box_site(parts, structure=[lid, *walls], rules=GIVES_WAY)
    (lift,) = plan_lifts(site, prepare(site)).lifts
    assert lift.status is Status.INFEASIBLE
    assert "clearance" not in lift.reason
    assert lift.clearance_m is None


def test_a_load_clear_above_the_yard_comes_near_nothing_again_while_its_rope_is_not_clear_yet():
    rules = Rules(transit_clearance_m=1.0, rope_clearance_m=0.5, gives_way=("transit_clearance_m", "rope_clearance_m"))
    parts = [("a", (2.0, 2.0, 0.0), (3.0, 3.0, 1.0), {"start_vox": (22, 5, 1)})]
    beam = ("beam", (12.0, 2.5, 6.0), (12.5, 4.0, 7.0))
    site = box_site(parts, structure=[beam], rules=rules, crane=test_crane(base=(13.0, 13.0, 0.0)))
    preparation = prepare(site)
    plan = plan_lifts(site, preparation)
    assert verify_plan(plan).verified
    assert verify_motions(plan, time_plan(plan, preparation)).verified
    # The rope has no room; the load keeps all of its clearance.
    assert [(lift.status, lift.kept) for lift in plan.lifts] == [(Status.PLANNED, Kept(None, 0.0))]


def test_the_jib_of_a_mobile_crane_needs_no_room_of_the_rope_over_its_own_undercarriage():
    crane = dataclasses.replace(default_luffing_crane("mobile-100t"), base_m=(12.0, 18.0, 0.0))
    crane = with_luffing_jib(crane, dataclasses.replace(crane.luffing, length_m=26.0))
    rules = Rules(transit_clearance_m=1.0, rope_clearance_m=1.0, gives_way=("transit_clearance_m", "rope_clearance_m"))
    site = box_site(PORTAL, crane=crane, shape=(60, 50, 34), rules=rules)
    half_m, top_m = crane.mast_size_m / 2.0, crane.luffing.pivot_height_m
    cells = box_cells(site.frame, (12.0 - half_m, 18.0 - half_m, 0.0), (12.0 + half_m, 18.0 + half_m, top_m))
    site = dataclasses.replace(site, blockers=(*site.blockers, Blocker("crane", "crane", cells)))
    plan = plan_lifts(site, prepare(site))
    assert {lift.status for lift in plan.lifts} == {Status.PLANNED}
    assert {lift.kept for lift in plan.lifts} == {ALL_KEPT}
