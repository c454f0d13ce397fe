"""Planners that the caller brings: their path is used only if it is valid, and costs no more than its lift."""

import time

import numpy as np
import pytest
from box_sites import PORTAL, box_site

from bimvox.planning.assembly import Assembly
from bimvox.planning.external import External, NotUsedError, PathsProposed, without_external
from bimvox.planning.one_lift import policies_of
from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.planning.rollout import GREEDY, proposer
from bimvox.planning.rounds import OtherWays
from bimvox.planning.search import shortest_path
from bimvox.proof.plan import verify_plan
from bimvox.records.lift import Method
from bimvox.site.collision import placement_is_free
from bimvox.site.site import Rules


@pytest.fixture(scope="module")
def site():
    return box_site(PORTAL, rules=Rules(rope=False))


@pytest.fixture(scope="module")
def transit(site):
    preparation = prepare(site)
    return Assembly(site, preparation).begin(preparation.sequence.order[0]).transit


def over(start, goal, space):
    """Up, across and down: three waypoints."""
    top = space.shape[2] - 6
    return [start, (*start[:2], top), (*goal[:2], top), goal]


def external(site, paths, limit_s=20.0):
    return External("mine:paths", PathsProposed(paths, site.frame), Method.PLANNER, limit_s, proposer(GREEDY))


def lies(start, goal, space):
    return [start, (start[0], start[1], 0), goal]


def far(start, goal, space):
    top = space.shape[2] - 6
    return [
        *over(start, goal, space)[:2],
        *[(x, start[1], top) for x in (start[0], start[0] - 1) * 700],
        *over(start, goal, space)[2:],
    ]


def fails(start, goal, space):
    raise RuntimeError("no\n  samples left")


def leaves(start, goal, space):
    raise SystemExit(3)


@pytest.mark.parametrize(
    ("paths", "reason"),
    [
        (lambda *_: None, "it found no path"),
        (lambda *_: [], r"it returned an array of shape \(0,\)"),
        (lambda *_: "rubbish", r"it returned an array of shape \(\)"),
        (lambda *_: np.zeros((0, 3)), "it returned an empty path"),
        (lambda start, goal, _: [goal, start], "its path begins at"),
        (lambda start, goal, _: [start], "its path ends at"),
        (lies, r"its path is not free at \(\d+, \d+, \d+\), move \d+ of \d+"),
        (lambda start, goal, _: [start, (-3, 0, 0), goal], r"its path is not free at \(-?\d+"),
        (far, r"its path has [\d,]+ moves, more than"),
        (fails, "it raised RuntimeError: no samples left"),
        (leaves, "it raised SystemExit: 3"),
        (lambda start: start, "it raised TypeError"),
    ],
)
def test_what_is_no_valid_path_is_not_used_and_the_reason_is_said(site, transit, paths, reason):
    with pytest.raises(NotUsedError, match=reason):
        external(site, paths)(transit)


def test_a_planner_that_does_not_end_is_interrupted(site, transit):
    def hangs(start, goal, space):
        while True:
            space.is_free(start)

    began = time.monotonic()
    with pytest.raises(NotUsedError, match=r"it took longer than 0\.05 s"):
        external(site, hangs, 0.05)(transit)
    assert time.monotonic() - began < 15.0


def test_a_planner_that_cannot_be_interrupted_is_not_asked_while_it_is_busy(site, transit, monkeypatch):
    def stubborn(start, goal, space):
        ends = time.monotonic() + 3.0
        while time.monotonic() < ends:
            try:
                while time.monotonic() < ends:
                    pass
            except BaseException:  # noqa: BLE001
                pass

    monkeypatch.setattr("bimvox.planning.external._GRACE_S", 0.01)
    one = external(site, stubborn, 0.05)
    with pytest.raises(NotUsedError, match="took longer"):
        one(transit)
    with pytest.raises(NotUsedError, match="still busy with an earlier lift"):
        one(transit)


def test_a_valid_path_is_recorded_by_the_name_of_its_planner(site):
    plan = plan_lifts(site, prepare(site), propose=external(site, over))
    assert {(lift.method, lift.planner, lift.found_by) for lift in plan.lifts} == {
        (Method.PLANNER, "mine:paths", "mine:paths")
    }
    assert all(lift.planner_note is None and lift.moves >= lift.shortest_moves for lift in plan.lifts)
    assert any(lift.moves > lift.shortest_moves for lift in plan.lifts)
    assert verify_plan(plan).verified


def test_a_planner_that_fails_costs_only_its_lift(site):
    asked = []

    def sometimes(start, goal, space):
        asked.append(space.part)
        return over(start, goal, space) if space.part == "beam" else lies(start, goal, space)

    plan, without = (
        plan_lifts(site, prepare(site), propose=one) for one in (external(site, sometimes), proposer(GREEDY))
    )
    assert asked == [site.components[lift.component].id for lift in plan.lifts]  # once for each lift, in order
    for lift, engine in zip(plan.lifts, without.lifts, strict=True):
        if site.components[lift.component].id == "beam":
            assert (lift.found_by, lift.planner_note) == ("mine:paths", None)
        else:
            assert (lift.method, lift.planner) == (engine.method, None)
            np.testing.assert_array_equal(lift.path_vox, engine.path_vox)
            assert lift.planner_note.startswith("mine:paths: its path is not free at")
    assert verify_plan(plan).verified


def test_a_path_that_its_proof_refuses_is_planned_by_the_engine_with_the_same_last_moves(site):
    preparation, propose = prepare(site), external(site, over)
    plan = plan_lifts(site, preparation, propose=propose)
    names = [site.components[lift.component].id for lift in plan.lifts]
    ways = OtherWays()
    assert ways.without(site, plan.lifts, {names[1]: "motion: it swings", "ghost": "no such lift"}) == {
        "ghost": "no such lift"
    }
    assert ways.of(names[1]) == ((), None)
    again = plan_lifts(site, preparation, propose=propose, other_ways=ways)
    assert [lift.found_by == "mine:paths" for lift in again.lifts] == [True, False, True, True]
    assert again.lifts[1].planner_note == "mine:paths: its path was not proven: motion: it swings"
    np.testing.assert_array_equal(again.lifts[1].last_moves_vox, plan.lifts[1].last_moves_vox)
    # What fails again is the engine's own: other last moves are tried.
    assert ways.without(site, again.lifts, {names[1]: "motion: it swings"}) == {}
    assert ways.of(names[1])[1] == "motion: it swings"


def test_what_is_asked_next_follows(site):
    engine = proposer(GREEDY)
    first = External(
        "a", lambda transit: None, Method.PLANNER, instead=External("b", engine, Method.POLICY, instead=engine)
    )
    assert [method for _, method in policies_of(first)] == [Method.PLANNER, Method.POLICY, Method.GREEDY]
    assert without_external(first) is engine
    assert without_external(None) is None


def test_the_engines_search_is_a_planner_too(site, transit):
    found = External(
        "search", lambda one: shortest_path(one.space, one.start_vox, one.goal_vox).path_vox, Method.PLANNER
    )
    np.testing.assert_array_equal(
        found(transit), shortest_path(transit.space, transit.start_vox, transit.goal_vox).path_vox
    )


def test_a_path_does_not_come_back_to_where_a_load_only_rises():
    site = box_site(PORTAL, rules=Rules(rope=False, transit_clearance_m=1.0))
    preparation = prepare(site)
    lift = Assembly(site, preparation).begin(preparation.sequence.order[0]).transit
    x, y, z = lift.start_vox
    assert not placement_is_free(lift.space._replace(cleared=np.zeros((0, 0, 0), bool)), x, y, z)

    shortest = shortest_path(lift.space, lift.start_vox, lift.goal_vox).path_vox.tolist()
    np.testing.assert_array_equal(external(site, lambda *_: shortest)(lift), shortest)
    with pytest.raises(NotUsedError, match=r"comes back to \(\d+, \d+, \d+\), which is free only straight up"):
        external(site, lambda *_: [shortest[0], (x, y, z + 1), *shortest])(lift)
