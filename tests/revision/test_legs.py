"""What a lift keeps of its motion when something is in the way of the rest."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from planned_frame import planned

from bimvox.library.prove import prepared
from bimvox.library.site import rasterise
from bimvox.log.reader import read_log
from bimvox.motion.time_plan import KnownLegs
from bimvox.motion.trajectories import approached
from bimvox.progress import SilentProgress
from bimvox.proof.motion import verify_motions
from bimvox.proof.plan import verify_plan
from bimvox.records.motion import PhaseName
from bimvox.revision.current_plan import RevisionRequest, current_plan_of
from bimvox.revision.revise import revise
from bimvox.revision.versions import Reading, Validity, obstructed_cells, version_of
from bimvox.site.build import with_obstructions
from bimvox.site.obstructions.obstruction_set import Box, Obstruction, ObstructionSet


@pytest.fixture(scope="module")
def frame():
    """Return the current plan of the sample frame and the preparation of its site."""
    log = read_log(planned() / "frame.mcap")
    return current_plan_of(log.plan, log.motions), prepared(log.plan.site, SilentProgress())[1]


def with_boxes(site, cells):
    """Return a site with a box within each of some cells."""
    size_m = site.frame.voxel_size_m
    lows = [site.frame.corner_of(cell) + 0.2 * size_m for cell in cells]
    boxes = [Obstruction(f"box {n}", Box(tuple(low), tuple(low + 0.6 * size_m))) for n, low in enumerate(lows)]
    return with_obstructions(site, ObstructionSet.of(boxes), rasterise)


def only_on_the_approach(current, order):
    """Return a cell that is met by the empty hook before a lift, and by nothing else of it; None if there is none."""
    shape, swept = current.plan.site.shape, current.swept_by(order)
    full = {(c, k) for one in (swept.carrying, current.versions[order][0].path()) for c, k in bits(one)}
    left = [cell for cell in bits(swept.approach) if cell not in full]
    if not left:
        return None
    # Half as high as its way: near the yard it would be too near to the part, too.
    column, height = sorted(left, key=lambda cell: cell[1])[len(left) // 2]
    return np.array([*divmod(column, shape[1]), height])


def bits(footprint):
    """Return the flat columns and heights of the cells of a footprint."""
    rows = np.unpackbits(footprint.heights.view(np.uint8), axis=1, bitorder="little")
    return [(int(footprint.columns[row]), int(height)) for row, height in zip(*np.nonzero(rows), strict=True)]


def revised(current, preparation, site, monkeypatch, *, keeps=True):
    """Return the last part of a revision, and what the lifts keep whose motions are made: nothing if not ``keeps``."""
    found, real = [], Validity.legs

    def legs(self, lift):
        found.append(real(self, lift) if keeps else KnownLegs(lift.order))
        return found[-1]

    with monkeypatch.context() as patch:
        patch.setattr(Validity, "legs", legs)
        *_, part = revise(current, RevisionRequest(site, preparation, first=1000))
    return part, found


def same_motions(one, other):
    assert one.keys() == other.keys()
    for order, motion in one.items():
        again = other[order]
        assert motion.phases == again.phases
        for own, its in zip(motion.trajectories, again.trajectories, strict=True):
            assert np.array_equal(own.time_ns, its.time_ns)
            assert np.allclose(own.axes, its.axes, rtol=0.0, atol=1e-9)


def test_the_approach_of_a_lift_with_another_path_is_what_would_be_made(frame, monkeypatch):
    current, preparation = frame
    paths = [lift.path_vox for lift in current.plan.lifts if lift.path_vox is not None]
    site = with_boxes(current.plan.site, [path[len(path) // 2] for path in paths[::4]])
    part, kept = revised(current, preparation, site, monkeypatch)
    assert sum(known.approach is not None for known in kept) >= 2
    anew, _ = revised(current, preparation, site, monkeypatch, keeps=False)
    same_motions(part.current.motions, anew.current.motions)


def test_a_lift_with_another_approach_is_carried_as_before(frame, monkeypatch):
    current, preparation = frame
    cells = {order: only_on_the_approach(current, order) for order in current.motions}
    order, cell = next((order, cell) for order, cell in cells.items() if cell is not None)
    site = with_boxes(current.plan.site, [cell])
    part, kept = revised(current, preparation, site, monkeypatch)
    assert order in [known.order for known in kept if known.carrying is not None]
    was, now = current.motions[order], part.current.motions[order]
    assert part.current.plan.lifts[order] is current.plan.lifts[order]
    assert np.array_equal(np.diff(now.loaded.time_ns), np.diff(was.loaded.time_ns))
    assert now.hooked_ns - now.start_ns == int(now.approach.time_ns[-1])
    assert verify_plan(part.current.plan).verified
    assert verify_motions(part.current.plan, part.current.chain).verified
    anew, _ = revised(current, preparation, site, monkeypatch, keeps=False)
    same_motions(part.current.motions, anew.current.motions)


def test_another_approach_moves_the_rest_in_time_and_by_whole_turns(frame):
    motion = frame[0].motions[3]
    longer = dataclasses.replace(
        motion.approach, time_ns=2 * motion.approach.time_ns, slew_rad=motion.approach.slew_rad + 2.0 * np.pi
    )
    other = approached(motion, longer)
    by_ns = int(motion.approach.time_ns[-1])
    assert other.phases[0] == dataclasses.replace(motion.phases[0], end_ns=motion.phases[0].end_ns + by_ns)
    assert [phase.name for phase in other.phases] == [phase.name for phase in motion.phases]
    assert all(a.end_ns == b.start_ns for a, b in zip(other.phases, other.phases[1:], strict=False))
    assert other.phases[-1].end_ns == other.end_ns == motion.end_ns + by_ns
    assert np.array_equal(other.loaded.time_ns, motion.loaded.time_ns + by_ns)
    assert np.allclose(other.raising.slew_rad - motion.raising.slew_rad, 2.0 * np.pi)
    assert other.phases[0].name is PhaseName.APPROACH


def test_nothing_is_kept_of_a_motion_that_begins_elsewhere(frame):
    current, preparation = frame
    site, (_, last, before, lift, *_) = current.plan.site, current.plan.lifts
    obstructed = obstructed_cells(site)

    def legs(motion, lift_now, before_now):
        version = version_of(site, lift, Reading(obstructed, 0b111, before), motion)
        validity = Validity({3: (version,)}, site, preparation)
        validity.now = Reading(validity.now.obstructed, 0b111, before_now)
        return validity.legs(lift_now)

    motion = current.motions[3]
    assert legs(motion, lift, before) == KnownLegs(3, motion.approach)
    assert legs(motion, lift, last) == KnownLegs(3)
    assert legs(motion, lift, None) == KnownLegs(3)
    moved = dataclasses.replace(lift, place=dataclasses.replace(lift.place, cell_vox=(0, 0, 0)))
    assert legs(motion, moved, before) == KnownLegs(3)
    stopped = dataclasses.replace(
        motion, phases=(dataclasses.replace(motion.phases[0], name=PhaseName.STOP), *motion.phases[1:])
    )
    assert legs(stopped, lift, before) == KnownLegs(3)
