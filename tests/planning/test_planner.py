import dataclasses

import numpy as np
import pytest
from box_sites import box_cells, box_site

from bimvox.planning.assembly import Assembly
from bimvox.planning.occupancy import target_cells
from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.planning.rollout import PLAN_LIMIT, proposer
from bimvox.planning.search import shortest_path
from bimvox.planning.stage import ProposedGreedily, Stage
from bimvox.policy.generalist.weights import load_generalist
from bimvox.proof.moment import moments
from bimvox.proof.plan import verify_plan
from bimvox.records.lift import Method, Status
from bimvox.records.steps import Steps, not_lifted_groups
from bimvox.site.means import Means
from bimvox.site.site import Blocker, Rules
from bimvox.walk import Store

PORTAL = [
    ("slab", (1.0, 1.0, 3.4), (5.0, 2.0, 3.6)),
    ("beam", (1.0, 1.4, 3.0), (5.0, 1.6, 3.4)),
    ("left", (1.0, 1.4, 0.0), (1.2, 1.6, 2.98), {"ifc_class": "IfcColumn", "erected": True}),
    ("right", (4.8, 1.4, 0.0), (5.0, 1.6, 2.98), {"ifc_class": "IfcColumn", "erected": True}),
]
LIKE = {
    **dict.fromkeys(("beam", "slab", "right"), lambda means: {}),
    "left": lambda means: {"means": means, "means_reason": "so"},
}
MISSING = Rules(rope=False, by_other_means=False)
"""A part that cannot be lifted is missing."""
WALL = ("wall", (8.0, 0.0, 0.0), (8.5, 15.0, 6.0))
"""A wall between yard and building, so that no path has Manhattan length."""


def plan_of(site, **options):
    return plan_lifts(site, prepare(site), **options)


def with_obstructions(site, *obstructions):
    more = [Blocker(name, "obstruction", box_cells(site.frame, low, high)) for name, low, high in obstructions]
    return dataclasses.replace(site, blockers=(*site.blockers, *more))


def lift_of(plan, name):
    return next(lift for lift in plan.lifts if plan.site.components[lift.component].id == name)


def test_every_part_of_a_portal_is_planned_from_yard_to_place():
    site = box_site(PORTAL)
    plan = plan_of(site)
    assert [lift.status for lift in plan.lifts] == [Status.PLANNED] * 4
    for order, lift in enumerate(plan.lifts):
        component = site.components[lift.component]
        assert lift.order == order
        assert lift.method is Method.SEARCH
        assert tuple(lift.path_vox[-1]) == component.target_vox
        assert tuple(lift.path_vox[0]) == lift.place.transit_start_vox
        assert site.yard[lift.place.cell_vox[:2]]
        assert (np.abs(np.diff(lift.path_vox, axis=0)).sum(axis=1) == 1).all()
        assert lift.moves == lift.shortest_moves


def searching(transit):
    return shortest_path(transit.space, transit.start_vox, transit.goal_vox).path_vox


def jumping(transit):
    return np.array([transit.start_vox, transit.goal_vox], np.int32)


def silent(transit):
    return None


def test_a_policys_path_is_taken_when_it_holds_and_dropped_when_not():
    site = box_site(PORTAL)
    assert {lift.method for lift in plan_of(site, propose=searching).lifts} == {Method.POLICY}
    assert {lift.method for lift in plan_of(site, propose=ProposedGreedily(searching)).lifts} == {Method.GREEDY}
    assert {lift.method for lift in plan_of(site, propose=jumping).lifts} == {Method.SEARCH}
    assert {lift.method for lift in plan_of(site, propose=silent).lifts} == {Method.SEARCH}
    again = plan_of(site, propose=silent, retrained=searching)
    assert {lift.method for lift in again.lifts} == {Method.RETRAINED}


def test_the_searched_path_is_taken_where_a_greedy_one_is_longer():
    def longer(transit):
        there = searching(transit)
        return np.concatenate([there[:2], there[:1], there[1:]])  # back once

    greedy, policy = (plan_of(box_site(PORTAL), propose=ask).lifts for ask in (ProposedGreedily(longer), longer))
    assert {(lift.method, lift.moves - lift.shortest_moves) for lift in greedy} == {(Method.SEARCH, 0)}
    assert {(lift.method, lift.moves - lift.shortest_moves) for lift in policy} == {(Method.POLICY, 2)}


def test_the_shipped_policy_is_asked_once_a_lift_and_stays_near_the_distance():
    site = with_obstructions(box_site(PORTAL), WALL)
    asked, decisions = [], []

    def values(observations):
        decisions.append(len(observations))
        return load_generalist()(observations)

    policy = proposer(values)

    def counting(transit):
        asked.append(transit)
        return policy(transit)

    plan = plan_of(site, propose=counting)
    assert len(asked) == 4
    away = sum(int(np.abs(np.subtract(one.start_vox, one.goal_vox)).sum()) for one in asked)
    assert set(decisions) == {1}
    assert len(decisions) <= PLAN_LIMIT.factor * away + 4 * PLAN_LIMIT.slack
    assert any(lift.method is Method.POLICY for lift in plan.lifts)


def test_a_part_that_cannot_be_lifted_is_set_by_other_means_and_the_rest_is_planned():
    site = with_obstructions(box_site(PORTAL), ("truck", (1.0, 1.0, 0.0), (1.5, 2.0, 1.0)))
    plan = plan_of(site)
    left, *others = (lift_of(plan, name) for name in ("left", "beam", "slab", "right"))
    assert (left.status, left.blocked_by, left.by_other_means, left.is_set) == (
        Status.INFEASIBLE,
        ("truck",),
        True,
        True,
    )
    assert all(lift.status is Status.PLANNED and not lift.by_other_means for lift in others)
    assert verify_plan(plan).verified
    # From its turn on it is in the way, and it never lies in the yard.
    for moment in moments(plan):
        here = [thing for thing in moment.present if thing.name == "left"]
        assert bool(here) == (moment.lift.order > left.order)
        assert all(np.array_equal(thing.cells, target_cells(site.components[left.component])) for thing in here)


@pytest.mark.parametrize("means", [Means.IN_SITU, Means.BY_HAND])
def test_what_is_no_lift_of_the_crane_is_there_from_its_turn_on(means):
    parts = [(*part[:3], {**(part[3] if len(part) > 3 else {}), **LIKE[part[0]](means)}) for part in PORTAL]
    site = box_site(parts)
    plan = plan_of(site)
    left, *others = (lift_of(plan, name) for name in ("left", "beam", "slab", "right"))
    assert (left.status.value, left.reason, left.place, left.is_set) == (means.value, "so", None, True)
    assert all(lift.status is Status.PLANNED for lift in others)
    assert verify_plan(plan).verified
    for moment in moments(plan):
        assert ("left" in {thing.name for thing in moment.present}) == (moment.lift.order > left.order)
        assert bool(moment.arrived) == (moment.lift.order == left.order + 1)
    (group,) = not_lifted_groups(site, plan.lifts, (), Steps())
    assert (group.means, group.lifts, group.needed_by_ns) == (means, (left,), None)


def test_a_lift_that_is_called_cast_in_place_is_refused():
    site = box_site(PORTAL)
    plan = plan_of(site)
    lifts = tuple(
        dataclasses.replace(lift, status=Status.IN_SITU, path_vox=None) if lift.order == 0 else lift
        for lift in plan.lifts
    )
    failures = verify_plan(dataclasses.replace(plan, lifts=lifts)).failures
    assert any("its means is crane, but its lift is in_situ" in failure for failure in failures)


def test_without_the_rule_an_obstruction_on_a_target_blocks_what_rests_on_that_part_too():
    site = box_site(PORTAL, rules=MISSING)
    plan = plan_of(with_obstructions(site, ("truck", (1.0, 1.0, 0.0), (1.5, 2.0, 1.0))))
    left, beam, slab, right = (lift_of(plan, name) for name in ("left", "beam", "slab", "right"))
    assert left.status is Status.INFEASIBLE
    assert left.blocked_by == ("truck",)
    assert beam.blocked_by == ("left",)
    assert slab.blocked_by == ("beam",)
    assert right.status is Status.PLANNED


def test_an_obstruction_in_the_yard_blocks_the_lift_that_starts_there():
    site = box_site(PORTAL)
    start = lift_of(plan_of(site), "right").place.cell_vox
    corner = np.array(start) * 0.5
    plan = plan_of(
        with_obstructions(site, ("bin", (corner[0], corner[1], 0.0), (corner[0] + 0.4, corner[1] + 0.4, 1.0)))
    )
    assert lift_of(plan, "right").blocked_by == ("bin",)
    assert lift_of(plan, "left").status is Status.PLANNED


def test_a_walled_in_target_names_the_walls():
    site = box_site([("a", (3.0, 3.0, 0.0), (4.0, 4.0, 1.0))])
    walls = [
        ("south", (2.0, 2.0, 0.0), (5.0, 2.5, 9.5)),
        ("north", (2.0, 4.5, 0.0), (5.0, 5.0, 9.5)),
        ("west", (2.0, 2.0, 0.0), (2.5, 5.0, 9.5)),
        ("east", (4.5, 2.0, 0.0), (5.0, 5.0, 9.5)),
    ]
    plan = plan_of(with_obstructions(site, *walls))
    assert plan.lifts[0].status is Status.INFEASIBLE
    assert set(plan.lifts[0].blocked_by) == {"south", "north", "west", "east"}
    assert "no path" in plan.lifts[0].reason


def test_a_column_next_to_a_wall_comes_down_along_it():
    """They share cells all the way down, so only the triangles can show that the descent is free."""
    site = box_site(
        [("wall", (3.0, 3.0, 0.0), (3.2, 6.0, 3.0)), ("column", (3.2, 3.0, 0.0), (3.6, 3.4, 3.0), {"erected": True})]
    )
    plan = plan_of(site)
    assert [lift.status for lift in plan.lifts] == [Status.PLANNED] * 2
    assert max(lift.contact_moves for lift in plan.lifts) >= 6


def test_a_part_under_an_overhang_that_shares_its_cells_goes_in_sideways():
    site = box_site(
        [("insert", (4.0, 4.0, 0.0), (5.0, 5.0, 0.9))],
        structure=[("roof", (4.5, 3.0, 0.92), (6.0, 6.0, 1.3))],
    )
    lift = plan_of(site).lifts[0]
    assert lift.status is Status.PLANNED
    assert lift.contact_moves > 0
    assert lift.path_vox[-1][0] != lift.path_vox[-1 - lift.contact_moves][0]


def test_a_part_under_a_lid_names_the_lid():
    box = [
        ("lid", (3.0, 3.0, 0.92), (6.0, 6.0, 1.3)),
        ("south", (3.0, 3.0, 0.0), (6.0, 3.9, 0.92)),
        ("north", (3.0, 5.1, 0.0), (6.0, 6.0, 0.92)),
        ("west", (3.0, 3.9, 0.0), (3.9, 5.1, 0.92)),
        ("east", (5.1, 3.9, 0.0), (6.0, 5.1, 0.92)),
    ]
    lift = plan_of(box_site([("insert", (4.0, 4.0, 0.0), (5.0, 5.0, 0.9))], structure=box)).lifts[0]
    assert lift.status is Status.INFEASIBLE
    assert lift.blocked_by == ("lid",)


def test_deliveries_reuse_the_yard_and_nothing_overlaps():
    parts = [(f"b{n}", (1.0, 1.0 + n, 0.0), (4.0, 1.4 + n, 0.5)) for n in range(12)]
    site = box_site(parts, yard=((24, 2), (34, 12)))
    preparation = prepare(site)
    deliveries = [place.delivery for place in preparation.places]
    assert max(deliveries) >= 2
    plan = plan_lifts(site, preparation)
    assert all(lift.status is Status.PLANNED for lift in plan.lifts)
    for delivery in set(deliveries):
        cells = [p.shape.cells + np.array(p.cell_vox) for p in preparation.places if p.delivery == delivery]
        stacked = np.concatenate(cells)
        assert len(np.unique(stacked, axis=0)) == len(stacked)


BLOCKS = [(f"b{n}", (1.0, 1.0 + n, 0.0), (4.0, 1.4 + n, 0.5)) for n in range(12)]  # 1,440 kg each


def test_a_delivery_weighs_no_more_than_a_truck_carries():
    site = box_site(BLOCKS)
    assert {place.delivery for place in prepare(site).places} == {0}
    limited = dataclasses.replace(site, rules=dataclasses.replace(site.rules, truckload_kg=4500.0))
    preparation = prepare(limited)
    deliveries = [place.delivery for place in preparation.places]
    assert sorted(deliveries) == [n // 3 for n in range(12)]
    taken = [{place.cell_vox for place in preparation.places if place.delivery == n} for n in range(4)]
    assert all(cells == taken[0] for cells in taken)  # each delivery uses the places that are empty again
    plan = plan_lifts(limited, preparation)
    assert verify_plan(plan).verified
    lighter = dataclasses.replace(limited, rules=dataclasses.replace(site.rules, truckload_kg=4000.0))
    failures = verify_plan(dataclasses.replace(plan, site=lighter)).failures
    assert "yard: delivery 0 weighs 4.32 t, more than the 4 t of a truckload" in failures
    alone = dataclasses.replace(site, rules=dataclasses.replace(site.rules, truckload_kg=1000.0))
    assert sorted(place.delivery for place in prepare(alone).places) == list(range(12))
    assert verify_plan(plan_of(alone)).verified


def test_a_place_that_the_site_file_gives_is_free_once_its_part_is_lifted():
    """The yard has room for two parts: the first has a given place, and the third lies where the first lay."""
    parts = [(f"b{n}", (1.0, 1.0 + n, 0.0), (4.0, 1.4 + n, 0.5)) for n in range(4)]
    name, low, high = parts[0]
    parts[0] = (name, low, high, {"start_vox": (30, 2, 1)})
    site = box_site(parts, yard=((30, 2), (36, 5)))
    preparation = prepare(site)
    places = [preparation.places[index] for index in preparation.sequence.order]
    assert places[0].cell_vox == (30, 2, 1)
    assert [place.delivery for place in places] == [0, 0, 1, 1]
    assert places[2].cell_vox == (30, 2, 1)
    assert verify_plan(plan_lifts(site, preparation)).verified


def test_a_part_too_big_for_the_yard_is_named():
    site = box_site([("long", (1, 1, 0), (12, 2, 1)), ("short", (1, 4, 0), (2, 5, 1))], yard=((30, 0), (40, 30)))
    plan = plan_of(site)
    assert "yard has no free place" in lift_of(plan, "long").reason
    assert lift_of(plan, "short").status is Status.PLANNED


def test_stages_clear_exactly_the_last_moves():
    site = box_site(PORTAL)
    preparation = prepare(site)
    assembly = Assembly(site, preparation)
    for index in preparation.sequence.order:
        stage = assembly.begin(index)
        assert isinstance(stage, Stage)
        rule = stage.clearance_with_insertion
        assert rule.cleared.sum() == len(stage.insertion.path_vox)
        assert all(rule.cleared[tuple(p - rule.cleared_low)] for p in stage.insertion.path_vox)
        assembly.finish(index, placed=True)


def test_an_explicit_start_wins():
    start = (30, 10, 1)
    site = box_site([("a", (1, 1, 0), (2, 2, 1), {"start_vox": start}), ("b", (4, 1, 0), (5, 2, 1))])
    assert prepare(site).places[0].cell_vox == start


def test_a_hung_part_is_not_set_when_what_it_hangs_on_is_not_in_place():
    """Arms of a pole; without the pole they would float."""
    parts = [("pole", (1.0, 1.0, 0.0), (2.0, 2.0, 3.0)), ("arm", (2.0, 1.0, 1.0), (4.0, 2.0, 1.5))]
    site = box_site(parts, rules=MISSING)
    assert [lift.status for lift in plan_of(site).lifts] == [Status.PLANNED] * 2
    plan = plan_of(with_obstructions(site, ("truck", (1.0, 1.0, 0.0), (1.4, 1.4, 1.0))))
    assert lift_of(plan, "pole").blocked_by == ("truck",)
    assert lift_of(plan, "arm").status is Status.INFEASIBLE
    assert lift_of(plan, "arm").blocked_by == ("pole",)


def test_a_part_that_hangs_on_structure_needs_no_other():
    site = box_site([("arm", (2.0, 1.0, 1.0), (4.0, 2.0, 1.5))], structure=[("wall", (1.0, 1.0, 0.0), (2.0, 2.0, 3.0))])
    assert [lift.status for lift in plan_of(site).lifts] == [Status.PLANNED]


def test_a_refused_lift_is_infeasible_with_its_reason():
    site = box_site(PORTAL, rules=MISSING)
    plan = plan_of(site, refused={"left": "it could not be proven"})
    assert lift_of(plan, "left").reason == "it could not be proven"
    assert lift_of(plan, "beam").blocked_by == ("left",)
    assert lift_of(plan, "right").status is Status.PLANNED


@pytest.mark.parametrize(("rules", "again"), [(MISSING, [1, 2, 3]), (Rules(rope=False), [1])])
def test_a_lift_of_the_same_site_is_planned_again_only_where_something_changed(rules, again, monkeypatch):
    site = box_site(PORTAL, rules=rules)
    preparation, begun, begin = prepare(site), [], Assembly.begin

    def spied(self, index, *more, **named):
        begun.append(index)
        return begin(self, index, *more, **named)

    monkeypatch.setattr(Assembly, "begin", spied)
    store = Store()
    before = plan_lifts(site, preparation, store=store)
    order = [lift.component for lift in before.lifts]
    assert begun == order
    begun.clear()
    kept = plan_lifts(site, preparation, store=store)
    assert begun == []
    assert all(one is other for one, other in zip(kept.lifts, before.lifts, strict=True))
    name = site.components[order[1]].id
    refused = plan_lifts(site, preparation, store=store, refused={name: "it fails"})
    assert begun == [order[n] for n in again]
    assert refused.lifts[0] is before.lifts[0]
    fresh = plan_lifts(site, preparation, refused={name: "it fails"})
    assert lift_of(fresh, name).reason == "it fails"
    for one, other in zip(refused.lifts, fresh.lifts, strict=True):
        assert (one.status, one.reason) == (other.status, other.reason)
        assert one.path_vox is other.path_vox is None or np.array_equal(one.path_vox, other.path_vox)
