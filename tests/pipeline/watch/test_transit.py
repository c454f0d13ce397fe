"""A change while the plan is carried out: what is done is kept, the load in the air stops and continues from there."""

from __future__ import annotations

import io
import itertools
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from planned_frame import planned
from seeded_faults import carried_out_until, obstruction_file_of, with_files

from bimvox.library.prove import prepared
from bimvox.library.site import rasterise
from bimvox.library.verify import prove, prove_plan
from bimvox.log.plan_log import PlanLog
from bimvox.log.reader import read_log
from bimvox.log.recorder import write_log
from bimvox.motion.swept import cells_of_axes, load_frame
from bimvox.motion.swing import rigged_crane
from bimvox.motion.time_lift import left_cells
from bimvox.progress import SilentProgress
from bimvox.proof.motion import verify_motions
from bimvox.proof.over_time import verify_motions_over_time, verify_plan_over_time
from bimvox.proof.plan import verify_plan
from bimvox.proof.swing import swung_placements
from bimvox.records.lift import Status
from bimvox.records.motion import Phase, PhaseName
from bimvox.revision.current_plan import CurrentPlan, RevisionPart, RevisionRequest, current_plan_of
from bimvox.revision.revise import revise
from bimvox.site.build import with_obstructions
from bimvox.site.obstructions.obstruction_set import EMPTY, Box, Obstruction, ObstructionSet
from bimvox.site.site import SwingRule
from bimvox.stop.brake_axes import stop_at
from bimvox.stop.choose_stop import CONTINUED, HOISTED, STOPPED, SWUNG, UNSAFE, swing_through
from bimvox.stop.redirect import Redirected
from bimvox.stop.resume import spliced
from bimvox.units import NS_PER_S


@pytest.fixture(scope="module")
def frame() -> tuple[Any, Any]:
    log = read_log(planned() / "frame.mcap")
    return log, prepared(log.plan.site, SilentProgress())[1]


def redirected(part):
    """Return the lift under way that was stopped and has a path to continue on; None if there is none."""
    return next((one for one in part.stops if isinstance(one, Redirected)), None)


def loaded_at(current: CurrentPlan, order: int, time_ns: int) -> np.ndarray:
    """Return the continuous reference cell of a lift's load at a time."""
    motion, site = current.motions[order], current.plan.site
    load = load_frame(site.cranes[0], site.frame, site.components[motion.component].hook_line_vox)
    times, axes = motion.samples()
    return cells_of_axes(load, np.array([[np.interp(time_ns, times, axis) for axis in axes.T]]))[0]


def carrying(current: CurrentPlan, order: int, share: float) -> int:
    """Return a time at which the load of a lift is carried."""
    motion = current.motions[order]
    first, last = (motion.start_ns + int(motion.loaded.time_ns[n]) for n in (0, -1))
    return int(first + share * (last - first))


def with_box(site: Any, cell: np.ndarray, size_vox: float = 1.0, name: str = "box") -> Any:
    low = site.frame.corner_of(np.floor(cell)) + 0.01
    high = low + size_vox * site.frame.voxel_size_m - 0.02
    return with_obstructions(site, ObstructionSet.of([Obstruction(name, Box(tuple(low), tuple(high)))]), rasterise)


def whole_proof(current: CurrentPlan) -> None:
    for proof in (
        verify_plan_over_time(current.plan, current.chain),
        verify_motions_over_time(current.plan, current.chain),
    ):
        assert proof.verified, proof.failures[:3]


def last_of(parts: Any) -> tuple[RevisionPart, CurrentPlan]:
    parts = list(parts)
    return parts[0], parts[-1].current


def met_at(frame: Any, order: int, share: float, later: float) -> tuple[CurrentPlan, int, Any]:
    """Return a plan, a time in it, and its site with a box that the load of a lift reaches later."""
    log, _ = frame
    current = current_plan_of(log.plan, log.motions)
    now_ns = carrying(current, order, share)
    cell = loaded_at(current, order, carrying(current, order, later))
    return current, now_ns, with_box(current.plan.site, np.round(cell))


@pytest.mark.parametrize(("order", "share", "later"), [(3, 0.3, 0.6), (5, 0.25, 0.55), (1, 0.4, 0.7), (6, 0.2, 0.65)])
def test_a_load_in_the_air_stops_and_continues_from_where_it_is(frame, order, share, later, tmp_path: Path):
    current, now_ns, site = met_at(frame, order, share, later)
    first, after = last_of(revise(current, RevisionRequest(site, frame[1], now_ns=now_ns)))
    was, now = current.motions[order], after.motions.get(order)
    for done in range(order):
        assert after.motions[done] is current.motions[done]
        assert after.plan.lifts[done] is current.plan.lifts[done]
    assert redirected(first) is not None, after.held_loads
    assert now is not None
    assert redirected(first).how in (STOPPED, HOISTED, CONTINUED)
    assert PhaseName.STOP in [phase.name for phase in now.phases]
    driven = was.loaded.time_ns + was.start_ns < redirected(first).stop.start_ns
    assert np.array_equal(now.loaded.slew_rad[: driven.sum()], was.loaded.slew_rad[driven])
    assert now.end_ns > was.end_ns
    assert after.motions[order + 1].start_ns == now.end_ns
    assert np.array_equal(after.plan.lifts[order].left[0].path_vox, current.plan.lifts[order].path_vox)
    whole_proof(after)
    # What was done need not be free of the new obstructions, but it is proven over time, and from the log alone.
    log = frame[0]
    stream = io.BytesIO()
    files = {**log.attachments, **obstruction_file_of(after.plan.site)}
    made = carried_out_until(type(log)(plan=after.plan, motions=after.chain), *after.plan.history)
    write_log(stream, with_files(made, files))
    (tmp_path / "log.mcap").write_bytes(stream.getvalue())
    again = read_log(tmp_path / "log.mcap")
    assert [epoch.until_ns for epoch in again.plan.history] == [now_ns]
    from bimvox.log.mcap.reader import read_contents, read_file

    contents = read_contents(read_file(tmp_path / "log.mcap"), tmp_path / "log.mcap")
    proof = prove(contents, again, SilentProgress())
    assert proof.verified, proof.failures[:3]
    assert_left_paths_are_proven(again, order)


def assert_left_paths_are_proven(log: PlanLog, order: int) -> None:
    """Forge the path that a load left: its end in time, a cell aside, all but its first cells, and no such path."""
    (left,) = log.plan.lifts[order].left
    aside = left.path_vox.copy()
    aside[len(aside) // 2] += (0, 0, 3)
    for forged, says in (
        ((replace(left, until_ns=left.until_ns + 1),), "epochs: "),
        ((replace(left, path_vox=aside),), "unit_moves: "),
        ((replace(left, path_vox=left.path_vox[:2]),), "unit_moves: "),
        ((), ""),
    ):
        lifts = tuple(replace(one, left=forged) if one.order == order else one for one in log.plan.lifts)
        found = prove_plan(replace(log, plan=replace(log.plan, lifts=lifts)), SilentProgress())
        assert not found.verified
        assert any(failure.startswith(says) for failure in found.failures), found.failures


def test_what_the_change_no_longer_affects_is_not_stopped(frame):
    log, preparation = frame
    current = current_plan_of(log.plan, log.motions)
    order = 4
    now_ns = carrying(current, order, 0.7)
    behind = np.round(loaded_at(current, order, carrying(current, order, 0.02)))
    site = with_box(current.plan.site, behind - [0, 0, 0])
    _, after = last_of(revise(current, RevisionRequest(site, preparation, now_ns=now_ns)))
    assert after.held is None
    assert after.motions[order] is current.motions[order]
    assert after.plan.lifts[order] is current.plan.lifts[order]
    assert not verify_motions(after.plan, after.chain).verified, "the new box is where the load was before"
    whole_proof(after)


def test_finished_lifts_never_change(frame):
    log, preparation = frame
    current = current_plan_of(log.plan, log.motions)
    now_ns = current.motions[5].start_ns
    place = current.plan.lifts[2].place
    assert place is not None
    site = with_box(current.plan.site, np.array(place.cell_vox), 3.0)
    _, after = last_of(revise(current, RevisionRequest(site, preparation, now_ns=now_ns)))
    assert all(after.plan.lifts[n] is current.plan.lifts[n] for n in range(5))
    assert not verify_plan(after.plan).verified, "its yard place is blocked now"
    whole_proof(after)


def test_a_load_without_a_path_is_held_until_there_is_one(frame):
    log, preparation = frame
    current = current_plan_of(log.plan, log.motions)
    order = 4
    lift = current.plan.lifts[order]
    component = current.plan.site.components[lift.component]
    now_ns = carrying(current, order, 0.3)
    site = with_box(current.plan.site, np.array(component.target_vox), 2.0, "pallet")
    _, held = last_of(revise(current, RevisionRequest(site, preparation, now_ns=now_ns)))
    assert held.held is not None
    assert held.plan.lifts[order].status is Status.INFEASIBLE
    assert "pallet" in held.plan.lifts[order].blocked_by
    assert held.pending == {
        n for n in range(order + 1, len(held.plan.lifts)) if held.plan.lifts[n].path_vox is not None
    }
    free = with_obstructions(site, EMPTY, rasterise)
    later_ns = now_ns + 600 * 10**9
    first, after = last_of(revise(held, RevisionRequest(free, preparation, now_ns=later_ns)))
    assert redirected(first) is not None, after.held_loads
    motion = after.motions[order]
    stops = [phase for phase in motion.phases if phase.name is PhaseName.STOP]
    assert stops[0].end_ns >= later_ns
    assert not after.pending
    assert [epoch.until_ns for epoch in after.plan.history] == [now_ns, later_ns]
    whole_proof(after)


def test_before_its_load_is_carried_a_lift_changes_its_path_in_time(frame):
    log, preparation = frame
    current = current_plan_of(log.plan, log.motions)
    order = 3
    motion = current.motions[order]
    hook_on = next(phase for phase in motion.phases if phase.name is PhaseName.HOOK_ON)
    now_ns = (hook_on.start_ns + hook_on.end_ns) // 2
    cell = np.round(loaded_at(current, order, carrying(current, order, 0.5)))
    site = with_box(current.plan.site, cell)
    first, after = last_of(revise(current, RevisionRequest(site, preparation, now_ns=now_ns)))
    assert redirected(first) is not None, after.held_loads
    assert redirected(first).stop is None
    assert after.motions[order].approach is motion.approach
    assert PhaseName.STOP not in [phase.name for phase in after.motions[order].phases]
    whole_proof(after)


def test_an_empty_hook_stops_and_goes_around(frame):
    log, preparation = frame
    current = current_plan_of(log.plan, log.motions)
    order = 4
    motion, site = current.motions[order], current.plan.site
    approach = motion.approach
    now_ns = motion.start_ns + int(0.1 * approach.time_ns[-1])
    at = int(0.75 * len(approach.time_ns))
    hook = load_frame(site.cranes[0], site.frame, np.zeros(3, np.int32))
    cell = cells_of_axes(hook, np.array([[approach.slew_rad[at], approach.radius_m[at], approach.height_m[at]]]))[0]
    site = with_box(site, np.round(cell))
    first, after = last_of(revise(current, RevisionRequest(site, preparation, now_ns=now_ns)))
    assert redirected(first) is not None, after.held_loads
    names = [phase.name for phase in after.motions[order].phases]
    assert names[:4] == [PhaseName.APPROACH, PhaseName.STOP, PhaseName.APPROACH, PhaseName.HOOK_ON]
    whole_proof(after)


def test_if_no_manoeuvre_is_free_it_is_reported(frame):
    log, preparation = frame
    current = current_plan_of(log.plan, log.motions)
    order = 3
    now_ns = carrying(current, order, 0.5)
    cell = np.round(loaded_at(current, order, now_ns))
    site = with_box(current.plan.site, cell - 4, 12.0)
    _, after = last_of(revise(current, RevisionRequest(site, preparation, now_ns=now_ns)))
    assert after.held is not None
    assert not after.held.loads[0].is_safe
    assert after.held.loads[0].how == UNSAFE
    assert UNSAFE in (after.plan.lifts[order].reason or "")


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_random_changes_while_it_is_carried_out(frame, seed):
    log, preparation = frame
    current = current_plan_of(log.plan, log.motions)
    rng = np.random.default_rng(seed)
    now_ns = 0
    for _ in range(4):
        end_ns = max(motion.end_ns for motion in current.motions.values())
        now_ns = int(now_ns + rng.uniform(0.05, 0.3) * max(end_ns - now_ns, 0)) + 1
        paths = [lift.path_vox for lift in current.plan.lifts if lift.path_vox is not None]
        path = paths[int(rng.integers(len(paths)))]
        cell = path[int(rng.integers(len(path)))]
        site = with_box(current.plan.site, cell.astype(float), float(rng.uniform(1.0, 3.0)))
        done = {order: motion for order, motion in current.motions.items() if motion.end_ns <= now_ns}
        _, current = last_of(revise(current, RevisionRequest(site, preparation, now_ns=now_ns)))
        assert all(current.motions[order] is motion for order, motion in done.items())
        if current.held is None:
            whole_proof(current)


def only_swung_into(current: CurrentPlan, order: int, now_ns: int) -> list[tuple[int, ...]]:
    """Return cells that the load of a lift reaches only by swinging when it is stopped at a time."""
    motion, site = current.motions[order], current.plan.site
    component, size_m = site.components[motion.component], site.frame.voxel_size_m
    rigged = rigged_crane(site, site.cranes[0], component)
    found = swing_through(motion, motion.loaded, stop_at(rigged, motion, now_ns), rigged.pendulum)
    load = rigged.load
    after = found.time_ns >= now_ns
    hanging = cells_of_axes(load, found.axes[after])
    swung = hanging + np.pad(found.swing.offset_m[after] / size_m, ((0, 0), (0, 1)))

    def taken(places: np.ndarray) -> set[tuple[int, ...]]:
        around = {tuple(c) for p in places for c in np.ndindex(2, 2, 2) for c in [np.where(c, np.ceil(p), np.floor(p))]}
        return {tuple(cell) for at in around for cell in (component.shape.cells + np.array(at, int)).tolist()}

    return sorted(taken(swung) - taken(hanging) - taken(cells_of_axes(load, motion.loaded.axes)))


def proof_finds(site: Any, held: Any, cell: tuple[int, ...]) -> bool:
    """Return whether a load that is held swings into a cell by the proof."""
    hold_ns = held.stop.end_ns - held.motion.start_ns + 3 * 10**10
    rest = replace(held.stop.trajectory, time_ns=np.array([0, 10**9], np.int64), **still(held.stop.pose))
    way = spliced(held.motion.loaded, held.stop, rest, held.stop.start_ns - held.motion.start_ns, hold_ns)
    stopped = replace(held.motion, phases=(Phase(PhaseName.STOP, held.stop.start_ns, held.motion.start_ns + hold_ns),))
    component = site.components[held.motion.component]
    places = swung_placements(site, site.cranes[0], stopped, way, component, 0)
    return any((component.shape.cells + place == cell).all(axis=1).any() for place in places)


@pytest.mark.slow
def test_a_stop_counts_how_far_its_load_swings(frame):
    log, preparation = frame
    current = current_plan_of(log.plan, log.motions)
    for order, share in itertools.product(range(8), (0.2, 0.3, 0.4, 0.5, 0.6)):
        now_ns = carrying(current, order, share)
        for cell in only_swung_into(current, order, now_ns)[::2]:
            site = with_box(current.plan.site, np.array(cell))
            _, after = last_of(revise(current, RevisionRequest(site, preparation, now_ns=now_ns)))
            # The planner takes some more swing, so the proof, which integrates the written samples, finds most of it.
            if (
                after.held is not None
                and after.held.loads[0].how == SWUNG
                and proof_finds(site, after.held.loads[0], cell)
            ):
                break
        else:
            continue
        break
    else:
        pytest.fail("no stopped load swings into a cell by the proof")
    held = after.held.loads[0]
    assert held is not None
    assert (held.how, held.is_safe) == (SWUNG, False)
    assert held.stop.swing_m > 0.1
    assert "as far out as it swings" in held.infeasible.reason
    # If swing is ignored, the load is clear of the box.
    off = replace(current.plan.site, rules=replace(current.plan.site.rules, swing=SwingRule.OFF))
    calm = current_plan_of(replace(current.plan, site=off), current.chain)
    _, after = last_of(revise(calm, RevisionRequest(with_box(off, np.array(cell)), preparation, now_ns=now_ns)))
    found = next(iter(after.held_loads), None)
    assert found is None or found.how == STOPPED


def still(pose: Any) -> dict[str, np.ndarray]:
    return {
        "slew_rad": np.full(2, pose.slew_rad),
        "radius_m": np.full(2, pose.radius_m),
        "height_m": np.full(2, pose.height_m),
    }


@pytest.mark.parametrize(("order", "phase"), [(0, PhaseName.SET), (3, PhaseName.RELEASE), (3, PhaseName.APPROACH)])
def test_a_box_at_the_empty_hook_keeps_what_is_done_and_says_why_nothing_follows(frame, order, phase):
    log, _ = frame
    current = current_plan_of(log.plan, log.motions)
    motion = current.motions[order + 1 if phase is PhaseName.APPROACH else order]
    now_ns = next(one for one in motion.phases if one.name is phase).start_ns + NS_PER_S
    hook = left_cells(current.plan.site, current.plan.lifts[order])[-1]
    site = with_box(current.plan.site, hook.astype(float))
    _, stuck = last_of(revise(current, RevisionRequest(site, frame[1], now_ns=now_ns)))
    assert [lift.order for lift in stuck.plan.lifts if lift.status is Status.PLANNED] == list(range(order + 1))
    reason = stuck.plan.lifts[order + 1].reason
    assert reason is not None
    assert "the hook cannot leave where the last part was set" in reason
    assert "meets box" in reason
    free = with_obstructions(site, EMPTY, rasterise)
    _, again = last_of(revise(stuck, RevisionRequest(free, frame[1], now_ns=now_ns + 60 * NS_PER_S)))
    if phase is PhaseName.APPROACH:  # it was moving when it met the obstruction, which cannot be proven
        assert again.held is not None
        return
    assert all(lift.status is Status.PLANNED for lift in again.plan.lifts)
    whole_proof(again)
