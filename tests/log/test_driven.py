"""Which samples of a lift viewers are shown."""

from __future__ import annotations

import dataclasses
from itertools import pairwise

import numpy as np
from planned_frame import planned

from bimvox.log.driven import driven
from bimvox.log.plan_log import LogRate
from bimvox.log.reader import read_log

_LATER_NS = 50_000_001


def with_borders_moved(motion):
    """Return a motion in which each phase but the first begins a little later, between two samples."""
    phases = list(motion.phases)
    for n, (_, other) in enumerate(pairwise(motion.phases)):
        border_ns = min(other.start_ns + _LATER_NS, other.end_ns - 1)
        phases[n] = dataclasses.replace(phases[n], end_ns=border_ns)
        phases[n + 1] = dataclasses.replace(other, start_ns=border_ns)
    return dataclasses.replace(motion, phases=tuple(phases))


def test_the_samples_around_a_phase_that_begins_between_them_are_shown():
    """The command at its start is on the line between them, so commands lead no further away than samples."""
    log = read_log(planned() / "frame.mcap")
    between = 0
    for lift, motion in zip(log.planned, log.motions, strict=True):
        moved = with_borders_moved(motion)
        time_ns, _ = moved.samples()
        shown = driven(log.plan.site, lift, moved, LogRate.MOTION).shown
        for phase in moved.phases:
            at = int(np.searchsorted(time_ns, phase.start_ns))
            assert shown[at]
            if time_ns[at] != phase.start_ns:
                assert shown[at - 1]
                between += 1
    assert between > len(log.motions)
