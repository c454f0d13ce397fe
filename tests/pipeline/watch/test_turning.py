"""A load that turns with the jib is stopped: the crew turns it to its final heading before it goes on."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
import pytest
from planned_sites import planned
from seeded_faults import carried_out_until, obstruction_file_of, site_file_of, with_files
from turning_sites import turning_site

from bimvox.library.prove import prepared
from bimvox.library.site import rasterise
from bimvox.library.verify import prove
from bimvox.log.mcap.reader import read_contents
from bimvox.log.plan_log import PlanLog
from bimvox.log.reader import read_log
from bimvox.log.recorder import write_log
from bimvox.motion.swept import cells_of_axes, load_frame
from bimvox.progress import SilentProgress
from bimvox.proof.over_time import verify_motions_over_time, verify_plan_over_time
from bimvox.records.motion import PhaseName
from bimvox.revision.current_plan import CurrentPlan, RevisionRequest, current_plan_of
from bimvox.revision.revise import revise
from bimvox.site.build import with_digests, with_obstructions
from bimvox.site.obstructions.obstruction_set import Box, Obstruction, ObstructionSet
from bimvox.stop.redirect import Held, Redirected

BEAM = 2  # its lift


@pytest.fixture(scope="module", params=[0.0, 2.0])
def current(request: pytest.FixtureRequest) -> tuple[CurrentPlan, Any]:
    site = with_digests(turning_site(transit_clearance_m=request.param))
    plan, motions = planned(site)
    return current_plan_of(plan, motions), prepared(site, SilentProgress())[1]


def at_share(current: CurrentPlan, share: float) -> int:
    motion = current.motions[BEAM]
    first, last = (motion.start_ns + int(motion.loaded.time_ns[n]) for n in (0, -1))
    return int(first + share * (last - first))


def with_box_at(current: CurrentPlan, time_ns: int) -> Any:
    """Return the site with a box of a cell where the load is at a time."""
    motion, site = current.motions[BEAM], current.plan.site
    load = load_frame(site.cranes[0], site.frame, site.components[motion.component].hook_line_vox)
    times, axes = motion.samples()
    cell = cells_of_axes(load, np.array([[np.interp(time_ns, times, axis) for axis in axes.T]]))[0]
    hook = np.round(cell) + site.components[motion.component].hook_offset_vox - (0, 0, 1)
    low = site.frame.corner_of(hook) + 0.01
    box = Box(tuple(low), tuple(low + 0.48))
    return with_obstructions(site, ObstructionSet.of([Obstruction("box", box)]), rasterise)


def revised(current: tuple[CurrentPlan, Any], site: Any, now_ns: int) -> tuple[Any, CurrentPlan]:
    parts = list(revise(current[0], RevisionRequest(site, current[1], now_ns=now_ns)))
    after = parts[-1].current
    for proof in (
        verify_plan_over_time(after.plan, after.chain),
        verify_motions_over_time(after.plan, after.chain),
    ):
        assert proof.verified, proof.failures[:3]
    return parts[0], after


@pytest.mark.parametrize(("share", "later"), [(0.1, 0.45), (0.3, 0.5), (0.35, 0.48)])
def test_a_load_in_the_air_is_turned_while_its_crane_waits(current, share, later):
    now_ns = at_share(current[0], share)
    first, after = revised(current, with_box_at(current[0], at_share(current[0], later)), now_ns)
    (stop,) = first.stops
    assert isinstance(stop, Redirected), stop.reason
    lift, motion = after.plan.lifts[BEAM], after.motions[BEAM]
    assert (lift.with_jib, lift.ever_with_jib) == (False, True)
    assert [left.with_jib for left in lift.left] == [True]
    names = [phase.name for phase in motion.phases]
    at = names.index(PhaseName.STOP)
    turned = float(np.interp(motion.phases[at].end_ns - motion.start_ns, motion.loaded.time_ns, motion.loaded.slew_rad))
    turned -= motion.loaded.slew_rad[0]
    assert names[at + 1] is PhaseName.TURN
    assert names.count(PhaseName.TURN) == 1
    span_ns = motion.phases[at + 1].end_ns - motion.phases[at + 1].start_ns
    assert span_ns / 1e9 == pytest.approx(abs(turned) / (np.pi / 2) * 30.0, abs=1e-6)


def test_its_log_is_proven_from_the_log_alone(current, tmp_path):
    now_ns = at_share(current[0], 0.3)
    _, after = revised(current, with_box_at(current[0], at_share(current[0], 0.5)), now_ns)
    site = after.plan.site
    files = {"site.toml": site_file_of(site), **obstruction_file_of(site)}
    stream = io.BytesIO()
    log = carried_out_until(PlanLog(plan=after.plan, motions=after.chain), *after.plan.history)
    write_log(stream, with_files(log, files))
    path = tmp_path / "log.mcap"
    path.write_bytes(stream.getvalue())
    proof = prove(read_contents(stream.getvalue(), path), read_log(path), SilentProgress())
    assert proof.verified, proof.failures[:3]


def test_a_load_that_is_not_carried_yet_still_turns_with_the_jib(current):
    motion = current[0].motions[BEAM]
    now_ns = motion.hooked_ns + 10**9
    _, after = revised(current, with_box_at(current[0], at_share(current[0], 0.5)), now_ns)
    lift = after.plan.lifts[BEAM]
    assert lift.with_jib
    assert lift.path_vox is not None
    assert after.motions[BEAM].turned_ns is not None


def test_a_load_that_is_turned_already_is_not_turned_again(current):
    motion = current[0].motions[BEAM]
    now_ns = motion.turned_ns[1] + 10**8
    site = with_box_at(current[0], motion.start_ns + int(motion.loaded.time_ns[-1]))
    parts = list(revise(current[0], RevisionRequest(site, current[1], now_ns=now_ns)))
    (stop,) = parts[0].stops
    assert isinstance(stop, Held)
    assert stop.motion.turned_ns == motion.turned_ns
    held = parts[-1].current.plan.lifts[BEAM]
    assert (held.path_vox, held.ever_with_jib) == (None, True)
