"""A plan of two cranes while it is carried out: what is done or unaffected is kept; one crane stops alone if it can."""

from __future__ import annotations

import dataclasses
from functools import cache
from typing import Any

import numpy as np
import pytest
from two_cranes import two_crane_site

from bimvox.crane.tower_crane import AxisLimits
from bimvox.cranes.schedule import time_lifts
from bimvox.library.site import rasterise
from bimvox.motion.swept import cells_of_axes, load_frame
from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.planning.preparation import Preparation
from bimvox.proof.over_time import verify_motions_over_time, verify_plan_over_time
from bimvox.records.lift import Status
from bimvox.records.motion import LiftMotion, PhaseName
from bimvox.revision.current_plan import CurrentPlan, RevisionPart, RevisionRequest, current_plan_of
from bimvox.revision.revise import revise
from bimvox.site.build import with_digests, with_obstructions
from bimvox.site.lifting import crane_for
from bimvox.site.obstructions.obstruction_set import EMPTY, Box, Obstruction, ObstructionSet

S = 10**9
SLOW = AxisLimits(0.01, 0.01, 0.01)


@cache
def planned(slow: bool = False) -> tuple[CurrentPlan, Preparation]:
    site = two_crane_site()
    if slow:  # so that both carry at the same time
        cranes = [dataclasses.replace(crane, slewing=SLOW, trolley=SLOW) for crane in site.cranes]
        site = with_digests(dataclasses.replace(site, cranes=tuple(cranes)))
    preparation = prepare(site)
    plan = plan_lifts(site, preparation)
    return current_plan_of(plan, time_lifts(plan, preparation)), preparation


def revised(current: CurrentPlan, site: Any, now_ns: int, hold_s: float = 30.0) -> RevisionPart:
    (part,) = revise(current, RevisionRequest(site, planned()[1], now_ns=now_ns, hold_s=hold_s))
    return part


def whole_proof(current: CurrentPlan) -> None:
    for proof in (
        verify_plan_over_time(current.plan, current.chain),
        verify_motions_over_time(current.plan, current.chain),
    ):
        assert proof.verified, proof.failures[:3]


def carried_at(motion: LiftMotion, share: float) -> int:
    """Return a time at which the load of a lift is carried."""
    first, last = (motion.start_ns + int(motion.loaded.time_ns[n]) for n in (0, -1))
    return int(first + share * (last - first))


def load_cell(current: CurrentPlan, order: int, time_ns: int) -> np.ndarray:
    """Return the reference cell of a lift's load at a time."""
    motion = current.motions[order]
    site = current.plan.site
    component = site.components[motion.component]
    load = load_frame(crane_for(site, site.cranes[motion.crane], component), site.frame, component.hook_line_vox)
    times, axes = motion.samples()
    return np.round(cells_of_axes(load, np.array([[np.interp(time_ns, times, axis) for axis in axes.T]]))[0])


def with_box(site: Any, cell: Any, size_vox: float = 1.0, name: str = "box") -> Any:
    low = site.frame.corner_of(np.floor(np.asarray(cell, float))) + 0.01
    high = low + size_vox * site.frame.voxel_size_m - 0.02
    return with_obstructions(site, ObstructionSet.of([Obstruction(name, Box(tuple(low), tuple(high)))]), rasterise)


def far_off(site: Any) -> Any:
    """Return a box in a corner of the site that no motion passes."""
    return with_box(site, (1, 38, 1))


def both_at_work(current: CurrentPlan, *, in_the_air: bool = False) -> tuple[int, int, int]:
    """Return two lifts of two cranes that are hooked on at the same time, and a time at which the first is carried."""
    for motion in current.chain:
        for other in current.chain:
            if other.crane == motion.crane or other.order < motion.order:
                continue
            for share in (0.3, 0.5, 0.7, 0.8):
                at_ns = carried_at(motion, share)
                from_ns = carried_at(other, 0.05) if in_the_air else other.hooked_ns + S
                if from_ns < at_ns < other.set_ns:
                    return motion.order, other.order, at_ns
    raise AssertionError("the cranes never carry at the same time")


def test_a_change_that_affects_nothing_changes_nothing():
    current, _ = planned()
    now_ns = carried_at(current.motions[3], 0.4)
    part = revised(current, far_off(current.plan.site), now_ns)
    assert all(part.current.motions[order] is motion for order, motion in current.motions.items())
    assert all(lift is was for lift, was in zip(part.current.plan.lifts, current.plan.lifts, strict=True))
    assert [epoch.until_ns for epoch in part.current.plan.history] == [now_ns]
    whole_proof(part.current)


def test_unaffected_lifts_under_way_continue_and_the_rest_is_scheduled_around_them():
    current, _ = planned()
    first, second, now_ns = both_at_work(current)
    last = max(current.motions)
    assert current.motions[last].hooked_ns > now_ns
    site = with_box(current.plan.site, load_cell(current, last, carried_at(current.motions[last], 0.5)))
    part = revised(current, site, now_ns)
    now = part.current
    assert not part.stops
    begun = [motion for motion in current.chain if motion.hooked_ns < now_ns]
    assert {first, second} <= {motion.order for motion in begun}
    for motion in begun:
        assert now.motions[motion.order].samples()[0].tolist() == motion.samples()[0].tolist()
        assert np.array_equal(now.motions[motion.order].samples()[1], motion.samples()[1])
    again = [motion for motion in now.chain if motion is not current.motions[motion.order]]
    assert last in {motion.order for motion in again}
    assert all(motion.hooked_ns >= now_ns + 30 * S for motion in again)
    assert last in (*part.replanned, *part.retimed)
    whole_proof(now)
    # Hooks that had started towards their next part are where they were at that time.
    for motion in current.chain:
        if motion.start_ns < now_ns <= motion.hooked_ns:
            times, axes = motion.samples()
            seen = times < now_ns
            again, other = now.motions[motion.order].samples()
            for axis in range(3):
                at = np.interp(times[seen], again, other[:, axis])
                assert np.allclose(at, axes[seen, axis], atol=1e-9)


@pytest.mark.parametrize("later", [0.5, 0.6])
def test_if_a_load_is_affected_all_cranes_stop_and_continue(later):
    current, _ = planned()
    first, second, now_ns = both_at_work(current)
    ahead = load_cell(current, first, carried_at(current.motions[first], later))
    site = with_box(current.plan.site, ahead)
    part = revised(current, site, now_ns)
    now = part.current
    assert now.held is None, [(one.lift.component, one.reason) for one in now.held_loads]
    assert [one.lift.order for one in part.stops] == [first, second]
    stop_ns, resumes_ns = now.motions[first].stops_ns[-1]
    assert now_ns <= stop_ns < now_ns + 2 * S
    assert resumes_ns >= now_ns + 30 * S
    for order in (first, second):
        was, again = current.motions[order], now.motions[order]
        assert again.start_ns + int(again.loaded.time_ns[-1]) > now_ns + 30 * S
        driven = was.samples()[0] < now_ns
        assert np.array_equal(again.samples()[1][: driven.sum()], was.samples()[1][driven])
    assert now.plan.lifts[first].left
    assert not now.plan.lifts[second].left, "what is hooked on and not met keeps its way"
    for motion in now.chain:
        if motion.order not in (first, second) and motion.released_ns > now_ns:
            assert motion.set_ns <= now_ns or motion.hooked_ns >= now_ns + 30 * S
    whole_proof(now)


def earlier_and_later(current: CurrentPlan) -> tuple[int, int, int]:
    """Return two lifts of two cranes, in order, and a time at which both are hooked on and the first is still up."""
    for motion in current.chain:
        for other in current.chain:
            if other.crane != motion.crane and other.order > motion.order:
                at_ns = carried_at(motion, 0.8)
                if other.hooked_ns + S < at_ns:
                    return motion.order, other.order, at_ns
    raise AssertionError("no two lifts overlap")


@pytest.mark.parametrize("share", [0.3, 1.0])
def test_if_only_a_later_load_is_affected_the_other_crane_goes_on(share):
    current, _ = planned()
    first, second, now_ns = earlier_and_later(current)
    site = with_box(current.plan.site, load_cell(current, second, carried_at(current.motions[second], share)))
    part = revised(current, site, now_ns)
    now = part.current
    assert [one.lift.order for one in part.stops] == [second]
    assert np.array_equal(now.motions[first].samples()[1], current.motions[first].samples()[1])
    assert now.motions[first].phases == current.motions[first].phases
    if share < 1.0:
        assert now.held is None
        assert now.motions[second].phases != current.motions[second].phases
        whole_proof(now)
        return
    # The box stands at the place of the second: it is held alone, also by a change that comes when the first is done.
    assert [one.lift.order for one in now.held_loads] == [second]
    later_ns = current.motions[first].end_ns + 100 * S
    (part,) = revise(now, RevisionRequest(far_off(site), planned()[1], now_ns=later_ns))
    assert part.current.motions[first].released_ns == current.motions[first].released_ns
    whole_proof(part.current)


def test_the_crane_that_goes_on_stops_if_it_is_affected_too():
    current, _ = planned()
    first, second, now_ns = earlier_and_later(current)
    target = load_cell(current, second, carried_at(current.motions[second], 1.0))
    held = revised(current, with_box(current.plan.site, target), now_ns).current
    assert [one.lift.order for one in held.held_loads] == [second]
    ahead = load_cell(current, first, carried_at(current.motions[first], 0.98))
    both = revised(held, with_box(current.plan.site, ahead), now_ns + S).current
    assert [one.lift.order for one in both.held_loads] in ([first], [first, second])
    free = with_obstructions(current.plan.site, EMPTY, rasterise)
    now = revised(both, free, now_ns + 300 * S).current
    assert now.held is None
    assert set(now.motions) == set(current.motions)
    whole_proof(now)


def test_a_load_without_a_path_holds_all_cranes_until_there_is_one():
    current, _ = planned()
    first, second, now_ns = both_at_work(current)
    target = np.array(current.plan.site.components[current.motions[first].component].target_vox)
    site = with_box(current.plan.site, target, 2.0, "pallet")
    part = revised(current, site, now_ns)
    held = part.current
    assert held.held is not None
    assert [one.lift.order for one in held.held_loads] == [first, second]
    assert "pallet" in held.plan.lifts[first].blocked_by
    assert held.plan.lifts[second].status is Status.INFEASIBLE
    assert held.plan.site.components[current.motions[first].component].id in held.plan.lifts[second].reason
    assert held.pending == {lift.order for lift in current.plan.lifts if lift.order > second}
    assert set(held.motions) == {order for order in current.motions if order < first}
    # Another change that does not help changes nothing.
    still = revised(held, with_box(site, target, 2.5, "pallet"), now_ns + 60 * S).current
    assert still.held is not None
    later_ns = now_ns + 600 * S
    free = with_obstructions(site, EMPTY, rasterise)
    part = revised(still, free, later_ns)
    now = part.current
    assert now.held is None
    assert not now.pending
    assert set(now.motions) == set(current.motions)
    assert all(now.motions[order].stops_ns[0][1] >= later_ns for order in (first, second))
    assert [epoch.until_ns for epoch in now.plan.history] == [now_ns, now_ns + 60 * S, later_ns]
    whole_proof(now)


def test_a_part_not_carried_yet_takes_a_longer_path_and_both_paths_are_proven():
    current, _ = planned()
    motion = current.motions[6]
    now_ns = motion.hooked_ns + 5 * S
    site = current.plan.site  # a wall across its path, over which the crane can lift it
    low, high = site.frame.corner_of(np.array([0, 9, 1])) + 0.01, site.frame.corner_of(np.array([40, 10, 12])) - 0.01
    wall = ObstructionSet.of([Obstruction("wall", Box(tuple(low), tuple(high)))])
    part = revised(current, with_obstructions(site, wall, rasterise), now_ns)
    now = part.current
    assert now.held is None, [one.reason for one in now.held_loads]
    assert now.plan.lifts[6].moves > current.plan.lifts[6].moves
    path, before = now.plan.lifts[6].path_vox, current.plan.lifts[6].path_vox
    assert path[:, 2].max() > before[:, 2].max()
    whole_proof(now)


def test_what_is_about_to_begin_is_kept_if_the_change_affects_later_lifts():
    current, _ = planned()
    last = max(current.motions)
    now_ns = current.motions[3].hooked_ns - 5 * S
    site = with_box(current.plan.site, load_cell(current, last, carried_at(current.motions[last], 0.5)))
    now = revised(current, site, now_ns).current
    assert now.motions[3] is current.motions[3], "it begins before anything new may, and is not touched"
    assert now.motions[last] is not current.motions[last]
    whole_proof(now)


def test_an_obstruction_at_a_hook_holds_that_hook_and_everything():
    current, _ = planned()
    motion, now_ns = on_the_way(current)
    site = current.plan.site
    hook = load_frame(crane_for(site, site.cranes[motion.crane], None), site.frame, np.zeros(3, np.int32))
    times, axes = motion.samples()
    cell = cells_of_axes(hook, np.array([[np.interp(now_ns + S, times, axis) for axis in axes.T]]))[0]
    boxed = with_box(current.plan.site, np.round(cell) - [1, 1, 0], 3.0)
    held = revised(current, boxed, now_ns).current
    assert held.held is not None
    assert "hook" in held.plan.lifts[motion.order].reason
    assert all(order < motion.order for order in held.motions)
    again = revised(held, with_obstructions(boxed, EMPTY, rasterise), now_ns + 100 * S).current
    assert again.held is not None, "the way on which it met something cannot be proven any more"


def on_the_way(current: CurrentPlan) -> tuple[LiftMotion, int]:
    """Return a lift whose empty hook moves to its part while its crane has no load, and a time in that move."""
    for motion in current.chain:
        for start_ns, end_ns, _ in motion.ways_ns(PhaseName.APPROACH):
            if end_ns - start_ns > 20 * S:
                return motion, start_ns + (end_ns - start_ns) // 3
    raise AssertionError("no empty hook goes far")


def test_an_affected_empty_hook_stops_and_goes_around():
    current, _ = planned()
    motion, now_ns = on_the_way(current)
    site = current.plan.site
    hook = load_frame(crane_for(site, site.cranes[motion.crane], None), site.frame, np.zeros(3, np.int32))
    times, axes = motion.samples()
    ahead_ns = now_ns + 8 * S
    cell = cells_of_axes(hook, np.array([[np.interp(ahead_ns, times, axis) for axis in axes.T]]))[0]
    part = revised(current, with_box(current.plan.site, np.round(cell)), now_ns)
    now = part.current
    assert now.held is None
    names = [phase.name for phase in now.motions[motion.order].phases]
    assert names[:3] == [PhaseName.APPROACH, PhaseName.STOP, PhaseName.APPROACH]
    whole_proof(now)
    # The proof checks the path on which it brakes: no box was there before.
    stopped = now.motions[motion.order]
    times, axes = stopped.samples()
    rests_ns = stopped.stops_ns[0][0] + 3 * S
    cell = cells_of_axes(hook, np.array([[np.interp(rests_ns, times, axis) for axis in axes.T]]))[0]
    spoiled = dataclasses.replace(now.plan, site=with_box(now.plan.site, np.round(cell), name="late"), history=())
    proof = verify_motions_over_time(spoiled, now.chain)
    assert any("empty hook" in failure and "late" in failure for failure in proof.failures), proof.failures


@pytest.mark.slow
def test_two_loads_in_the_air_both_stop_and_continue():
    current, preparation = planned(slow=True)
    first, second, now_ns = both_at_work(current, in_the_air=True)
    site = with_box(current.plan.site, load_cell(current, first, carried_at(current.motions[first], 0.9)))
    (part,) = revise(current, RevisionRequest(site, preparation, now_ns=now_ns, hold_s=30.0))
    now = part.current
    assert now.held is None, [one.reason for one in now.held_loads]
    assert all(PhaseName.STOP in [phase.name for phase in now.motions[n].phases] for n in (first, second))
    assert now.motions[second].set_ns >= now.motions[first].released_ns
    whole_proof(now)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(6))
def test_random_changes_while_it_is_carried_out(seed):
    current, _ = planned()
    rng = np.random.default_rng(seed)
    now_ns = 0
    for _ in range(4):
        end_ns = max([motion.end_ns for motion in current.motions.values()], default=now_ns + 600 * S)
        now_ns = int(now_ns + rng.uniform(0.05, 0.3) * max(end_ns - now_ns, 600 * S)) + 1
        paths = [lift.path_vox for lift in current.plan.lifts if lift.path_vox is not None]
        path = paths[int(rng.integers(len(paths)))]
        cell = path[int(rng.integers(len(path)))]
        site = with_box(current.plan.site, cell.astype(float), float(rng.uniform(1.0, 3.0)))
        if rng.uniform() < 0.3:
            site = with_obstructions(site, EMPTY, rasterise)
        done = {order: motion for order, motion in current.motions.items() if motion.released_ns <= now_ns}
        current = revised(current, site, now_ns).current
        for order, motion in done.items():
            assert np.array_equal(current.motions[order].loaded.slew_rad, motion.loaded.slew_rad)
            assert current.motions[order].released_ns == motion.released_ns
        if current.held is None:
            whole_proof(current)


def test_three_changes_in_a_hold_stop_it_once():
    current, _ = planned()
    first, _, now_ns = both_at_work(current)
    ahead = load_cell(current, first, carried_at(current.motions[first], 0.55))
    site = with_box(current.plan.site, ahead)
    for n in range(3):
        at = ahead + np.array([n, 0, 0])
        site = with_box(current.plan.site, at, 1.0 + n)
        current = revised(current, site, now_ns + n * 12 * S).current
        if current.held is not None:
            break
        whole_proof(current)
    else:
        assert len(current.motions[first].stops_ns) == 1


def test_the_same_change_gives_the_same_plan():
    current, _ = planned()
    first, _, now_ns = both_at_work(current)
    site = with_box(current.plan.site, load_cell(current, first, carried_at(current.motions[first], 0.55)))
    one, other = (revised(current, site, now_ns).current for _ in range(2))
    assert (one.held is None) is (other.held is None)
    for a, b in zip(one.chain, other.chain, strict=True):
        assert a.phases == b.phases
        assert all(np.array_equal(x, y) for x, y in zip(a.samples(), b.samples(), strict=True))


def test_a_faulty_hold_is_found():
    current, _ = planned()
    first, _, now_ns = both_at_work(current)
    site = with_box(current.plan.site, load_cell(current, first, carried_at(current.motions[first], 0.55)))
    now = revised(current, site, now_ns).current
    assert now.held is None
    # The load continues along its previous path, not along its new one.
    spoiled = {**now.motions, first: current.motions[first]}
    proof = verify_motions_over_time(now.plan, tuple(spoiled[order] for order in sorted(spoiled)))
    assert not proof.verified
