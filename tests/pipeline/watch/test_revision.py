"""Revising a plan step by step: the whole proof accepts it, and the same lifts are feasible as when planning anew."""

from __future__ import annotations

import dataclasses
import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from planned_frame import planned

from bimvox.errors import MotionError
from bimvox.library.prove import plan_and_prove, prepared
from bimvox.library.search import check_search
from bimvox.library.site import rasterise
from bimvox.log.plan_log import PlanLog
from bimvox.log.reader import read_log
from bimvox.log.recorder import write_log
from bimvox.log.segments import newest, pending_of, segment_of
from bimvox.motion.time_lift import time_lift
from bimvox.policy.choice import NO_POLICY
from bimvox.progress import SilentProgress
from bimvox.proof.footprint import path_footprint
from bimvox.proof.motion import verify_motions
from bimvox.proof.plan import verify_plan
from bimvox.records.lift import Lift, Status, same_path
from bimvox.revision import draft
from bimvox.revision.current_plan import CurrentPlan, RevisionRequest, current_plan_of
from bimvox.revision.revise import revise
from bimvox.site.build import with_obstructions
from bimvox.site.default_rules import ALL_KEPT
from bimvox.site.obstructions.obstruction_set import EMPTY, Box, Obstruction, ObstructionSet


@pytest.fixture(scope="module")
def frame() -> tuple[Any, Any]:
    """Return the plan of the sample frame and the preparation of its site."""
    log = read_log(planned() / "frame.mcap")
    return log, prepared(log.plan.site, SilentProgress())[1]


def random_set(rng: np.random.Generator, current: CurrentPlan) -> ObstructionSet:
    """Return some boxes: on paths, on starts and targets, anywhere, sometimes a wall or the whole site."""
    site = current.plan.site
    size_m = site.frame.voxel_size_m
    found = []
    for number in range(int(rng.integers(0, 4))):
        paths = [lift.path_vox for lift in current.plan.lifts if lift.path_vox is not None]
        kind = rng.random()
        cell = rng.integers((0, 0, 1), site.shape)
        if paths and kind < 0.6:
            path = paths[int(rng.integers(len(paths)))]
            cell = path[int(rng.integers(len(path)))]
        elif kind < 0.75:
            target = site.components[int(rng.integers(len(site.components)))]
            cell = np.array(target.target_vox) + target.shape.cells[0]
        low = site.frame.corner_of(cell) + 0.1 * size_m
        high = low + size_m * rng.uniform(0.3, 4.0 if kind < 0.9 else 30.0, size=3)
        found.append(Obstruction(f"box {number}", Box(tuple(low), tuple(high))))
    return ObstructionSet.of(found)


def without_clock(motion: Any) -> tuple[Any, ...]:
    """Return a motion without its start time and without whole turns."""
    parts = motion.trajectories
    turns = 2.0 * np.pi * np.round(parts[0].slew_rad[0] / (2.0 * np.pi))
    return tuple(
        (part.time_ns.tolist(), part.radius_m.tolist(), part.height_m.tolist(), np.round(part.slew_rad - turns, 9))
        for part in parts
    )


def same_but_for_the_fewest_moves(was: Lift, now: Lift) -> bool:
    names = [field.name for field in dataclasses.fields(was) if field.name != "shortest_moves"]
    return all(getattr(was, name) is getattr(now, name) for name in names)


def check_kept(before: CurrentPlan, after: CurrentPlan, made: set[int]) -> None:
    for was, now in zip(before.plan.lifts, after.plan.lifts, strict=True):
        if was.order in made:
            continue
        assert now is was or now.shortest_moves is None
        assert same_but_for_the_fewest_moves(was, now)
        if was.status is Status.PLANNED:
            old, new = before.motions[was.order], after.motions[was.order]
            assert new.end_ns - new.start_ns == old.end_ns - old.start_ns
            for one, other in zip(without_clock(old), without_clock(new), strict=True):
                assert one[:3] == other[:3]
                turned = one[3] - other[3]
                assert np.allclose(turned, turned[0])


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(6))
def test_random_changes_end_in_a_plan_that_the_whole_proof_accepts(frame, seed):
    log, preparation = frame
    rng = np.random.default_rng(seed)
    current = current_plan_of(log.plan, log.motions)
    for _ in range(6):
        site = with_obstructions(current.plan.site, random_set(rng, current), rasterise)
        first = current
        made: set[int] = set()
        for part in revise(current, RevisionRequest(site, preparation, first=2)):
            current = part.current
            made |= set(part.made)
        assert not current.pending
        assert current.plan.site is site
        check_kept(first, current, made)
    plan = current.plan
    proof = verify_plan(plan)
    assert proof.verified, proof.failures
    proof = verify_motions(plan, current.chain)
    assert proof.verified, proof.failures
    searched = check_search(PlanLog(plan=plan, motions=current.chain, revision=6), SilentProgress())
    assert searched.failures == []
    to_search = [
        one
        for one in plan.lifts
        if one.status is Status.INFEASIBLE or one.shortest_moves is not None or one.kept != ALL_KEPT
    ]
    assert (searched.samples + len(searched.undecided) > 0) == bool(to_search)


@pytest.mark.parametrize("seed", range(10, 14))
def test_the_same_lifts_are_infeasible_as_when_planned_from_scratch(frame, seed):
    log, preparation = frame
    rng = np.random.default_rng(seed)
    current = current_plan_of(log.plan, log.motions)
    for _ in range(4):
        obstructions = random_set(rng, current)
        site = with_obstructions(current.plan.site, obstructions, rasterise)
        if not obstructions.obstructions:
            continue
        for part in revise(current, RevisionRequest(site, preparation)):
            current = part.current
        statuses = [lift.status for lift in current.plan.lifts]
        if Status.PLANNED not in statuses:
            current = current_plan_of(log.plan, log.motions)
            continue
        scratch = plan_and_prove(site, preparation, NO_POLICY, progress=SilentProgress())
        assert statuses == [lift.status for lift in scratch.plan.lifts]


def test_a_part_blocked_by_an_obstruction_is_set_by_other_means_and_what_rests_on_it_keeps_its_path(frame):
    log, preparation = frame
    start = current_plan_of(log.plan, log.motions)
    component = log.plan.site.components[log.plan.lifts[0].component]
    low = log.plan.site.frame.corner_of(component.target_vox) + 0.1
    on_target = ObstructionSet.of([Obstruction("truck", Box(tuple(low), tuple(low + 0.2)))])
    *_, blocked = revise(start, RevisionRequest(with_obstructions(log.plan.site, on_target, rasterise), preparation))
    first, *others = blocked.current.plan.lifts
    assert (first.blocked_by, first.by_other_means) == (("truck",), True)
    assert all(same_path(was, now) for was, now in zip(log.plan.lifts[1:], others, strict=True))


def test_a_removal_brings_infeasible_lifts_back_and_keeps_the_others(frame):
    log, preparation = frame
    rules = dataclasses.replace(log.plan.site.rules, by_other_means=False)
    plan = dataclasses.replace(log.plan, site=dataclasses.replace(log.plan.site, rules=rules))
    log = dataclasses.replace(log, plan=plan)
    start = current_plan_of(log.plan, log.motions)
    component = log.plan.site.components[log.plan.lifts[0].component]
    low = log.plan.site.frame.corner_of(component.target_vox) + 0.1
    on_target = ObstructionSet.of([Obstruction("truck", Box(tuple(low), tuple(low + 0.2)))])
    *_, blocked = revise(start, RevisionRequest(with_obstructions(log.plan.site, on_target, rasterise), preparation))
    lifts = blocked.current.plan.lifts
    assert lifts[0].status is Status.INFEASIBLE
    assert lifts[0].blocked_by == ("truck",)
    rests_on_it = [lift for lift in lifts if component.id in lift.blocked_by]
    assert rests_on_it
    assert blocked.current.chain[0].start_ns == 0
    assert blocked.current.chain[0].approach is None
    *_, free = revise(blocked.current, RevisionRequest(with_obstructions(log.plan.site, EMPTY, rasterise), preparation))
    assert all(lift.status is Status.PLANNED for lift in free.current.plan.lifts)
    assert verify_motions(free.current.plan, free.current.chain).verified


def test_if_nothing_is_affected_nothing_is_made(frame):
    log, preparation = frame
    start = current_plan_of(log.plan, log.motions)
    site = log.plan.site
    nowhere = site.frame.corner_of(np.array([*np.array(site.shape[:2]) - 1, 1])) + 0.1
    far = ObstructionSet.of([Obstruction("far", Box(tuple(nowhere), tuple(nowhere + 0.2)))])
    (part,) = revise(start, RevisionRequest(with_obstructions(site, far, rasterise), preparation))
    assert part.made == ()
    assert part.change.cells > 0
    for was, now in zip(start.plan.lifts, part.current.plan.lifts, strict=True):
        # Of a longer path it is no longer known whether it still has the fewest moves.
        assert now is was or (was.shortest_moves < len(was.path_vox) - 1 and same_but_for_the_fewest_moves(was, now))
    assert all(start.motions[order] is motion for order, motion in part.current.motions.items())


def test_a_part_does_not_wait_for_its_footprints(frame, monkeypatch):
    log, preparation = frame
    start = current_plan_of(log.plan, log.motions)
    lift = start.plan.lifts[1]
    low = log.plan.site.frame.corner_of(lift.path_vox[len(lift.path_vox) // 2]) + 0.1
    box = ObstructionSet.of([Obstruction("box", Box(tuple(low), tuple(low + 0.2)))])
    made = []

    def making(site: Any, lift: Lift) -> Any:
        made.append(lift.order)
        return path_footprint(site, lift)

    monkeypatch.setattr(draft, "path_footprint", making)
    parts = revise(start, RevisionRequest(with_obstructions(log.plan.site, box, rasterise), preparation, first=1000))
    part = next(parts)
    assert part.replanned
    assert not made
    assert list(parts) == []
    assert sorted(made) == [order for order in part.made if order in part.current.versions]


def test_segments_on_top_of_a_log_give_the_newest_plan(frame, tmp_path: Path):
    log, preparation = frame
    rng = np.random.default_rng(3)
    current = current_plan_of(log.plan, log.motions)
    segments = []
    for _ in range(3):
        site = with_obstructions(current.plan.site, random_set(rng, current), rasterise)
        for part in revise(current, RevisionRequest(site, preparation, first=1)):
            current = part.current
            record = segment_of(
                PlanLog(current.plan, revision=len(segments) + 1),
                current.motions,
                part.made,
                current.pending,
                {"why": "test"},
            )
            path = tmp_path / f"{len(segments)}.mcap"
            with path.open("wb") as stream:
                write_log(stream, record)
            segments.append(read_log(path))
            assert segments[-1].events[0].fields["why"] == "test"
            assert pending_of(segments[-1]) == current.pending
            proof = verify_plan(segments[-1].plan, segments[-1].context)
            assert proof.verified, proof.failures
            proof = verify_motions(segments[-1].plan, segments[-1].motions, segments[-1].context)
            assert proof.verified, proof.failures
    found = newest(log, segments)
    assert found.revision == len(segments)
    assert found.plan.site.digest == current.plan.site.digest
    assert [lift.status for lift in found.plan.lifts] == [lift.status for lift in current.plan.lifts]
    stream = io.BytesIO()
    write_log(stream, found)
    assert verify_motions(found.plan, found.motions).verified
    for one, other in zip(found.motions, current.chain, strict=True):
        assert (one.start_ns, one.end_ns) == (other.start_ns, other.end_ns)


def test_lifts_that_are_put_off_are_planned_as_if_they_were_not(frame):
    log, preparation = frame
    start = current_plan_of(log.plan, log.motions)
    rng = np.random.default_rng(11)
    put_off = 0
    for _ in range(6):
        site = with_obstructions(log.plan.site, random_set(rng, start), rasterise)
        (*_, whole) = revise(start, RevisionRequest(site, preparation, first=1000))
        assert not whole.current.undecided
        parts = list(revise(start, RevisionRequest(site, preparation, first=1)))
        half = parts[0].current
        assert half.undecided <= half.pending
        for order in half.undecided:
            was, now = start.plan.lifts[order], half.plan.lifts[order]
            assert same_but_for_the_fewest_moves(was, now), "until it is decided, it has its earlier path"
        put_off += len(half.undecided)
        assert not any(part.current.undecided for part in parts[1:])
        for one, other in zip(whole.current.plan.lifts, parts[-1].current.plan.lifts, strict=True):
            assert (one.status, one.reason, one.clearance_m) == (other.status, other.reason, other.clearance_m)
            assert same_path(one, other)
    assert put_off


def test_a_change_before_all_lifts_are_decided_forgets_none(frame):
    log, preparation = frame
    start = current_plan_of(log.plan, log.motions)
    rng = np.random.default_rng(11)
    for _ in range(20):
        site = with_obstructions(log.plan.site, random_set(rng, start), rasterise)
        half = next(revise(start, RevisionRequest(site, preparation, first=1))).current
        if not half.undecided:
            continue
        far = site.frame.corner_of(np.array([*np.array(site.shape[:2]) - 1, 1])) + 0.1
        nowhere = Obstruction("far", Box(tuple(far), tuple(far + 0.2)))
        there = [b for b in site.blockers if b.kind == "obstruction"]
        both = with_obstructions(site, ObstructionSet.of([nowhere]), rasterise)
        both = dataclasses.replace(both, blockers=(*both.blockers, *there))
        *_, last = revise(half, RevisionRequest(both, preparation))
        assert not last.current.pending
        assert verify_plan(last.current.plan).verified
        assert verify_motions(last.current.plan, last.current.chain).verified
        return
    raise AssertionError("no change left a lift undecided")


def test_a_plan_resumed_halfway_is_finished(frame):
    log, preparation = frame
    current = current_plan_of(log.plan, log.motions)
    rng = np.random.default_rng(5)
    parts = []
    while len(parts) < 2:
        site = with_obstructions(current.plan.site, random_set(rng, current), rasterise)
        parts = list(revise(current, RevisionRequest(site, preparation, first=1)))
    half = parts[0].current
    orders = half.pending
    cut = [lift for lift in half.plan.lifts if lift.order not in orders]
    assert orders
    assert len(cut) + len(orders) == len(half.plan.lifts)
    # As read from disk: pending lifts have neither path nor motion.
    record = segment_of(PlanLog(half.plan, revision=1), half.motions, parts[0].made, orders, {})
    again = newest(log, [record])
    taken_up = current_plan_of(again.plan, again.motions)
    assert taken_up.pending == orders
    *_, last = revise(taken_up, RevisionRequest(again.plan.site, preparation))
    assert not last.current.pending
    assert verify_plan(last.current.plan).verified
    assert verify_motions(last.current.plan, last.current.chain).verified


def test_what_is_recalled_is_still_proven(frame, monkeypatch):
    log, preparation = frame
    first = current_plan_of(log.plan, log.motions)
    site = first.plan.site
    for part in site.components:
        low = site.frame.corner_of(np.array(part.target_vox)) + 0.1
        box = ObstructionSet.of([Obstruction("box", Box(tuple(low), tuple(low + 0.3)))])
        *_, with_box = revise(first, RevisionRequest(with_obstructions(site, box, rasterise), preparation))
        lost = {lift.order for lift in with_box.current.plan.lifts if lift.status is Status.INFEASIBLE}
        changed = {
            one.order for one in with_box.current.plan.lifts if one.path_vox is not first.plan.lifts[one.order].path_vox
        }
        if lost and changed == lost:  # every other path is kept beside the box
            break
    else:
        pytest.fail("each box is in the way of other parts too")

    def never(*_: Any, **__: Any) -> Any:
        raise AssertionError("it is known already")

    free = with_obstructions(site, EMPTY, rasterise)
    with monkeypatch.context() as known:
        known.setattr("bimvox.revision.keep_or_replan.plan_lift", never)
        known.setattr("bimvox.motion.time_plan.time_lift", never)
        parts = list(revise(with_box.current, RevisionRequest(free, preparation, first=3)))
    last = parts[-1].current
    assert lost <= {order for part in parts for order in part.made}
    for one, other in zip(last.plan.lifts, first.plan.lifts, strict=True):
        # Of a path that was kept beside the box it is no longer known whether it has the fewest moves.
        assert one is other if one.order in lost else one.path_vox is other.path_vox
    assert verify_plan(last.plan).verified
    assert verify_motions(last.plan, last.chain).verified
    assert [motion.end_ns for motion in last.chain] == [motion.end_ns for motion in first.chain]


def test_a_version_is_not_recalled_if_something_else_is_in_its_way(frame):
    log, preparation = frame
    first = current_plan_of(log.plan, log.motions)
    site, path = first.plan.site, first.plan.lifts[0].path_vox
    assert path is not None

    def box(name: str, cell: Any) -> Obstruction:
        low = site.frame.corner_of(np.array(cell)) + 0.1
        return Obstruction(name, Box(tuple(low), tuple(low + 0.3)))

    on_target = box("on target", site.components[first.plan.lifts[0].component].target_vox)
    on_path = box("on path", path[len(path) // 2])
    *_, blocked = revise(
        first, RevisionRequest(with_obstructions(site, ObstructionSet.of([on_target]), rasterise), preparation)
    )
    *_, other = revise(
        blocked.current, RevisionRequest(with_obstructions(site, ObstructionSet.of([on_path]), rasterise), preparation)
    )
    lift = other.current.plan.lifts[0]
    assert lift.status is Status.PLANNED
    assert not np.array_equal(lift.path_vox, path)
    assert verify_plan(other.current.plan).verified
    assert verify_motions(other.current.plan, other.current.chain).verified


@pytest.fixture(scope="module")
def in_the_way(frame) -> Any:
    """Return the frame's site with a box in the middle of every path."""
    log, _ = frame
    boxes = [
        Obstruction(f"box {n}", Box(tuple(low), tuple(low + 0.4)))
        for n, lift in enumerate(log.plan.lifts)
        if lift.path_vox is not None
        for low in [log.plan.site.frame.corner_of(lift.path_vox[len(lift.path_vox) // 2])]
    ]
    return with_obstructions(log.plan.site, ObstructionSet.of(boxes), rasterise)


def test_a_lift_that_the_crane_cannot_drive_is_named_and_the_others_are_planned(frame, in_the_way, monkeypatch):
    log, preparation = frame
    current = current_plan_of(log.plan, log.motions)
    whole = next(revise(current, RevisionRequest(in_the_way, preparation, first=6)))
    bad = whole.replanned[1]
    component = log.plan.site.components[current.plan.lifts[bad].component].id

    def timed(site, crane, lift, *more):
        if lift.order == bad:
            raise MotionError(component, "the rope is too short")
        return time_lift(site, crane, lift, *more)

    monkeypatch.setattr("bimvox.motion.time_plan.time_lift", timed)
    part = next(revise(current, RevisionRequest(in_the_way, preparation, first=6)))
    refused = part.current.plan.lifts[bad]
    assert refused.status is Status.INFEASIBLE
    assert refused.reason == f"the crane cannot drive its path: {component}: the rope is too short"
    assert set(part.replanned) >= {order for order in whole.replanned if order < bad}
