import dataclasses
from itertools import pairwise

import numpy as np
import pytest
from box_sites import box_site, test_crane

from bimvox.crane.kinematics import hook_of
from bimvox.errors import InputError
from bimvox.grid.summed_area import summed_area_table
from bimvox.motion import time_plan as timing
from bimvox.motion.commands import commands
from bimvox.motion.time_lift import Begins, time_lift
from bimvox.motion.time_plan import time_plan
from bimvox.planning.assembly import Assembly
from bimvox.planning.occupancy import stored_cells, target_cells
from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.planning.stage import Stage
from bimvox.proof.motion import verify_motions
from bimvox.records.lift import Status
from bimvox.records.motion import PhaseName
from bimvox.site.component import StoredPose
from bimvox.walk import Store

PORTAL = [
    ("slab", (1.0, 1.0, 3.5), (5.0, 2.0, 4.0)),
    ("beam", (1.0, 1.0, 3.0), (5.0, 1.5, 3.5)),
    ("left", (1.0, 1.0, 0.0), (1.5, 1.5, 3.0), {"ifc_class": "IfcColumn", "erected": True}),
    ("right", (4.5, 1.0, 0.0), (5.0, 1.5, 3.0), {"ifc_class": "IfcColumn", "erected": True}),
]

CREW_S = {"slab": [150, 180, 90], "beam": [150, 300, 120], "left": [150, 720, 150], "right": [150, 720, 150]}


@pytest.fixture(scope="module")
def planned():
    crane = test_crane(base=(10.0, -3.0, 0.0), jib=40.0, height=11.0)
    site = box_site(PORTAL, crane=crane)
    preparation = prepare(site)
    return plan_lifts(site, preparation), preparation


def stages(plan, preparation):
    assembly = Assembly(plan.site, preparation)
    for lift in plan.lifts:
        stage = assembly.begin(lift.component)
        if isinstance(stage, Stage):
            yield lift, stage.clearance_with_insertion
        assembly.finish(lift.component, placed=lift.status is Status.PLANNED)


@pytest.fixture(scope="module")
def motions(planned):
    return time_plan(*planned)


def test_every_lift_has_its_phases_in_order_on_one_clock(planned, motions):
    plan = planned[0]
    assert [lift.status for lift in plan.lifts] == [Status.PLANNED] * 4
    assert [motion.component for motion in motions] == [lift.component for lift in plan.lifts]
    assert motions[0].start_ns == 0
    order = list(PhaseName)
    for motion in motions:
        names = [phase.name for phase in motion.phases]
        assert names == sorted(names, key=order.index)
        assert (PhaseName.APPROACH in names) == (motion.order > 0) == (motion.approach is not None)
        assert {PhaseName.HOOK_ON, PhaseName.RAISE, PhaseName.LOWER, PhaseName.SET, PhaseName.RELEASE} <= set(names)
        assert motion.phases[0].start_ns == motion.start_ns
        assert motion.phases[-1].end_ns == motion.end_ns
        for one, other in pairwise(motion.phases):
            assert one.end_ns == other.start_ns
        lengths = {phase.name: (phase.end_ns - phase.start_ns) / 1e9 for phase in motion.phases}
        crew = [lengths[name] for name in (PhaseName.HOOK_ON, PhaseName.SET, PhaseName.RELEASE)]
        assert crew == CREW_S[plan.site.components[motion.component].id]
        carried = sum(lengths.get(name, 0.0) for name in (PhaseName.HOIST, PhaseName.TRAVERSE, PhaseName.LOWER))
        assert carried == pytest.approx(motion.loaded.duration_s, abs=1e-8)
    for one, other in pairwise(motions):
        assert one.end_ns == other.start_ns


def test_the_hook_moves_without_jumps_through_the_whole_site(planned, motions):
    times, axes = zip(*(motion.samples() for motion in motions), strict=True)
    time_ns, poses = np.concatenate(times), np.concatenate(axes)
    assert (np.diff(time_ns) >= 0).all()
    hook_m = hook_of(planned[0].site.cranes[0], *poses.T)
    assert np.linalg.norm(np.diff(hook_m, axis=0), axis=1).max() < 0.25
    turns = np.abs(np.diff(poses[:, 0]))
    assert turns.max() < 0.1


def test_the_hook_is_over_the_part_where_it_waits_and_where_it_is_set(planned, motions):
    site = planned[0].site
    for lift, motion in zip(planned[0].lifts, motions, strict=True):
        component = site.components[lift.component]
        offset = np.array(component.hook_line_vox)
        _, axes = motion.samples()
        hook_m = hook_of(site.cranes[0], *axes.T)
        target = np.array(component.target_vox) + offset
        assert hook_m[-1][:2] == pytest.approx(site.frame.centre_of(target)[:2])
        assert hook_m[-1][2] == pytest.approx(site.frame.corner_of(target)[2] + site.cranes[0].sling_m)
        first = hook_of(
            site.cranes[0], motion.raising.slew_rad[0], motion.raising.radius_m[0], motion.raising.height_m[0]
        )
        stored = stored_cells(lift.place)
        under = site.frame.cell_of(first - [0.0, 0.0, site.cranes[0].sling_m + 1e-6])
        assert (under == stored).all(axis=1).any()
        if lift.place.pose is StoredPose.LYING_X:
            assert under[0] == stored[:, 0].max()


def test_the_empty_hook_meets_nothing(planned, motions):
    plan, site = planned[0], planned[0].site
    for n, motion in enumerate(motions[1:], start=1):
        occupied = site.labels > 0
        for lift in plan.lifts[:n]:
            occupied[tuple(target_cells(site.components[lift.component]).T)] = True
        for lift in plan.lifts[n:]:
            occupied[tuple(stored_cells(lift.place).T)] = True
        way = motion.approach
        slings_m = hook_of(site.cranes[0], way.slew_rad, way.radius_m, way.height_m) - [
            0.0,
            0.0,
            site.cranes[0].sling_m - 1e-6,
        ]
        for cell in site.frame.cell_of(slings_m):
            assert not occupied[cell[0], cell[1], cell[2] :].any()
        assert way.bound_s <= way.duration_s


def test_the_same_plan_gives_the_same_motions(planned, motions):
    again = time_plan(*planned)
    for one, other in zip(motions, again, strict=True):
        assert one.phases == other.phases
        for a, b in zip(one.samples(), other.samples(), strict=True):
            assert a.tobytes() == b.tobytes()


def test_a_site_without_a_crane_is_refused():
    site = box_site(PORTAL[2:])
    with pytest.raises(InputError, match="no crane"):
        time_plan(plan_lifts(site, prepare(site)), prepare(site))


def test_a_lift_that_cannot_be_driven_is_named(planned):
    from bimvox.errors import PlanningError

    lift, space = next(stages(*planned))
    full = space._replace(
        table=summed_area_table(np.ones(planned[0].site.shape, bool)), cleared=np.zeros((0, 0, 0), bool)
    )
    name = planned[0].site.components[lift.component].id
    with pytest.raises(PlanningError, match=f"{name}: the path is not free"):
        time_lift(planned[0].site, planned[0].site.cranes[0], lift, full, Begins(None))


def test_commands_lead_along_the_motion(planned, motions):
    crane = planned[0].site.cranes[0]
    for motion in motions:
        own = list(commands(motion, 0.5))
        assert [command.time_ns for command in own] == sorted({command.time_ns for command in own})
        assert {command.order for command in own} == {motion.order}
        assert [command.phase for command in own] == [motion.phase_name_at(command.time_ns) for command in own]
        assert own[0].time_ns == motion.start_ns
        assert own[-1].time_ns == motion.end_ns
        assert (own[-1].slew_rate_rad_s, own[-1].trolley_rate_m_s, own[-1].hoist_rate_m_s) == (0.0, 0.0, 0.0)
        _, axes = motion.samples()
        pose = axes[0].copy()
        for command, following in pairwise(own):
            rates = np.array([command.slew_rate_rad_s, command.trolley_rate_m_s, command.hoist_rate_m_s])
            limits = np.array([crane.slewing.rate, crane.trolley.rate, crane.hoist.rate])
            assert (np.abs(rates) <= limits * (1 + 1e-6)).all()
            pose += rates * (following.time_ns - command.time_ns) / 1e9
            target = (command.target_slew_rad, command.target_radius_m, command.target_height_m)
            assert pose == pytest.approx(target, abs=1e-9)
            if command.phase in (PhaseName.HOOK_ON, PhaseName.SET, PhaseName.RELEASE):
                assert np.abs(rates).max() < 1e-9
        assert pose == pytest.approx(axes[-1], abs=1e-9)
        assert not own[0].loaded
        assert any(command.loaded for command in own)
    with pytest.raises(InputError, match="period"):
        commands(motions[0], 0.0)


def test_last_moves_from_the_side_are_driven_as_planned():
    """A part under an overhang that shares its cells: the cells cleared for the last moves are not a short cut."""
    roof = ("roof", (4.6, 3.0, 0.92), (6.0, 6.0, 1.3))
    site = box_site(
        [("insert", (2.5, 4.0, 0.0), (5.0, 5.0, 0.9))], structure=[roof], crane=test_crane(base=(13.0, 13.0, 0.0))
    )
    preparation = prepare(site)
    plan = plan_lifts(site, preparation)
    lift = plan.lifts[0]
    last = lift.path_vox[-1 - lift.contact_moves :]
    assert (last[:, :2] != last[0, :2]).any()
    motions = time_plan(plan, preparation)
    assert verify_motions(plan, motions).verified


def test_the_path_to_the_last_moves_does_not_cut_through_them():
    """A part on a pedestal next to a wall that shares its cells, reached from below on the other side."""
    pedestal, wall = ("pedestal", (4.0, 4.0, 0.0), (6.0, 6.0, 2.98)), ("wall", (3.0, 4.0, 0.0), (4.08, 6.0, 4.2))
    site = box_site(
        [("block", (4.1, 4.1, 3.0), (5.9, 5.9, 3.5))],
        structure=[pedestal, wall],
        yard=((14.0, 6.0), (20.0, 14.0)),
        crane=test_crane(base=(13.0, 13.0, 0.0)),
    )
    preparation = prepare(site)
    plan = plan_lifts(site, preparation)
    lift = plan.lifts[0]
    assert lift.contact_moves > 1
    assert verify_motions(plan, time_plan(plan, preparation)).verified


@pytest.fixture
def made_for(monkeypatch):
    """Orders of the lifts whose motions are made."""
    orders, time_lift = [], timing.time_lift

    def spied(site, crane, lift, *more):
        orders.append(lift.order)
        return time_lift(site, crane, lift, *more)

    monkeypatch.setattr(timing, "time_lift", spied)
    return orders


def are_alike(motions, others):
    return len(motions) == len(others) and all(
        (one.phases, one.start_ns, one.end_ns) == (two.phases, two.start_ns, two.end_ns)
        and all(
            (a.time_ns == b.time_ns).all() and (a.axes == b.axes).all()
            for a, b in zip(one.trajectories, two.trajectories, strict=True)
        )
        for one, two in zip(motions, others, strict=True)
    )


def test_known_motions_are_not_made_again(planned, motions, made_for):
    store = Store()
    assert are_alike(time_plan(*planned, store), motions)
    assert made_for == [0, 1, 2, 3]
    made_for.clear()
    assert are_alike(time_plan(*planned, store), motions)
    assert made_for == []


def test_only_another_lift_and_the_one_after_it_get_new_motions(planned, made_for):
    plan, preparation = planned
    store = Store()
    time_plan(plan, preparation, store)
    made_for.clear()
    other = dataclasses.replace(plan.lifts[1], path_vox=detour(plan.lifts[1].path_vox))
    changed = dataclasses.replace(plan, lifts=(plan.lifts[0], other, *plan.lifts[2:]))
    again = time_plan(changed, preparation, store)
    assert made_for == [1, 2]
    assert are_alike(again, time_plan(changed, preparation))


def test_after_a_part_that_is_no_longer_set_all_motions_are_made(planned, made_for):
    plan, preparation = planned
    store = Store()
    time_plan(plan, preparation, store)
    made_for.clear()
    out = dataclasses.replace(plan.lifts[1], status=Status.INFEASIBLE, reason="no path", path_vox=None)
    changed = dataclasses.replace(plan, lifts=(plan.lifts[0], out, *plan.lifts[2:]))
    again = time_plan(changed, preparation, store)
    assert made_for == [2, 3]
    assert are_alike(again, time_plan(changed, preparation))


def detour(path_vox):
    """Return a path that goes one cell up and down again at its highest place."""
    top = int(path_vox[:, 2].argmax())
    up = path_vox[top : top + 1] + np.array([[0, 0, 1]], path_vox.dtype)
    return np.concatenate([path_vox[: top + 1], up, path_vox[top:]])
