import dataclasses

from box_sites import box_site, test_crane

from bimvox.motion.time_plan import time_plan
from bimvox.planning.assembly import prepare, replay
from bimvox.planning.planner import plan_lifts
from bimvox.proof.motion import verify_motions
from bimvox.proof.plan import verify_plan
from bimvox.records.lift import Status
from bimvox.site.site import Rules

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
    site, preparation, plan = planned(0.5, crane=test_crane(base=(13.0, 13.0, 0.0)))
    assert [lift.status for lift in plan.lifts] == [Status.PLANNED] * 3
    assert verify_plan(plan).verified
    motions = time_plan(plan, replay(site, preparation, plan))
    assert verify_motions(plan, motions).verified


def test_no_room_above_the_yard_is_named():
    parts = [("a", (2.0, 2.0, 0.0), (3.0, 3.0, 1.0), {"start_vox": (22, 5, 1)})]
    posts = [("post", (12.0, 2.5, 0.0), (12.5, 4.0, 9.5)), ("other", (10.0, 2.5, 0.0), (10.5, 4.0, 9.5))]
    site = box_site(parts, structure=posts, rules=Rules(rope=False, transit_clearance_m=0.5))
    lift = plan_lifts(site, prepare(site)).lifts[0]
    assert lift.status is Status.INFEASIBLE
    assert "less than 0.5 m clearance" in lift.reason
    assert "post" in lift.blocked_by


def test_a_policys_path_without_the_margin_is_not_taken():
    site, preparation, _ = planned(1.0)
    _, _, close = planned(0.0)
    paths = {tuple(lift.path_vox[-1]): lift.path_vox for lift in close.lifts}

    def propose(transit):
        return paths.get(transit.goal_vox)

    plan = plan_lifts(site, preparation, propose=propose)
    assert verify_plan(plan).verified
