import dataclasses

import numpy as np
import pytest
from box_sites import box_site

from bimvox.planning.assembly import Assembly
from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.proof.moment import Thing, cells_in_common, moments, near_and_far
from bimvox.records.lift import Status

PARTS = [
    ("beam", (1.0, 1.0, 3.0), (5.0, 1.5, 3.5)),
    ("left", (1.0, 1.0, 0.0), (1.5, 1.5, 3.0), {"ifc_class": "IfcColumn", "erected": True}),
    ("right", (4.5, 1.0, 0.0), (5.0, 1.5, 3.0), {"ifc_class": "IfcColumn", "erected": True}),
]


@pytest.fixture(scope="module")
def planned():
    site = box_site(PARTS, structure=[("footing", (0.5, 0.5, 0.0), (1.0, 1.0, 0.5))])
    preparation = prepare(site)
    return plan_lifts(site, preparation), preparation


def test_it_agrees_with_the_planners_own_count_of_cells(planned):
    plan, preparation = planned
    assembly = Assembly(plan.site, preparation)
    seen = 0
    for moment in moments(plan):
        stage = assembly.begin(moment.lift.component)
        occupied = np.zeros(plan.site.shape, bool)
        for thing in moment.present:
            occupied[tuple(thing.cells.T)] = True
        x, y, z = plan.site.shape
        assert int(occupied.sum()) == int(stage.space.table[x, y, z])
        assembly.finish(moment.lift.component, placed=True)
        seen += 1
    assert seen == 3


def test_an_infeasible_part_stays_in_the_yard_and_is_never_placed(planned):
    plan, _ = planned
    left = next(lift for lift in plan.lifts if plan.site.components[lift.component].id == "left")
    lifts = tuple(
        dataclasses.replace(lift, status=Status.INFEASIBLE, path_vox=None) if lift is left else lift
        for lift in plan.lifts
    )
    found = list(moments(dataclasses.replace(plan, lifts=lifts)))
    assert [moment.lift.component for moment in found] == [x.component for x in plan.lifts if x is not left]
    for moment in found:
        assert left.component not in moment.placed
        assert "left" in {thing.name for thing in moment.present}


def test_lifts_that_are_not_carried_stand_where_they_were_put(planned):
    plan, _ = planned
    last = plan.lifts[-1]
    context = [dataclasses.replace(lift, path_vox=None) for lift in plan.lifts[:-1]]
    (moment,) = moments(dataclasses.replace(plan, lifts=(last,)), context)
    (*_, whole) = moments(plan)
    assert moment.placed == whole.placed == {lift.component for lift in context}
    assert moment.before is context[-1]
    assert {t.name for t in moment.present} == {t.name for t in whole.present} == {"ground", "footing", "left", "right"}


def test_near_is_what_touches_the_part_in_its_place_and_has_triangles(planned):
    plan, _ = planned
    (first, *_, last) = moments(plan)
    near, far = near_and_far(plan.site.components[last.lift.component], last.present)
    assert {thing.name for thing in near} == {"left", "right"}
    assert {thing.name for thing in far} == {"ground", "footing"}
    near, _ = near_and_far(plan.site.components[1], first.present)
    assert "ground" not in {thing.name for thing in near}
    assert [thing.name for thing in near] == ["footing"]
    assert len(cells_in_common(np.array([[0, 0, 0], [1, 2, 3]]), np.array([[1, 2, 3], [4, 4, 4]]))) == 1


def test_a_part_is_the_same_thing_at_every_moment_of_every_proof(planned):
    plan, _ = planned
    first, again = ({t.name: t for t in list(moments(plan))[-1].present} for _ in range(2))
    assert first.keys() == again.keys()
    assert all(again[name] is thing for name, thing in first.items())


def test_near_are_those_with_cells_beside_its_own_corners_included(planned):
    rng = np.random.default_rng(3)
    plan, _ = planned
    component = plan.site.components[0]
    own = component.shape.cells + component.target_vox
    for n in range(200):
        cells = (own.mean(axis=0) + rng.integers(-6, 7, 3)).astype(np.int32) + rng.integers(0, 2, (3, 3), np.int32)
        thing = Thing(str(n), cells, 7)
        apart = np.abs(own[:, None] - cells[None]).max(axis=2).min()
        assert near_and_far(component, [thing]) == (([thing], []) if apart <= 1 else ([], [thing]))
