"""Motions that a copy of this process makes are those that this process makes."""

from __future__ import annotations

import os
from contextlib import contextmanager

import numpy as np
from box_sites import box_site, test_crane

from bimvox.planning.assembly import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.revision import motions
from bimvox.revision.draft import RevisionDraft
from bimvox.revision.request import RevisionRequest


def test_motions_are_the_same_with_and_without_a_copy_of_the_process(monkeypatch):
    parts = [(f"b{n}", (1.0, 1.0 + 2 * n, 0.0), (3.0, 2.0 + 2 * n, 0.5)) for n in range(5)]
    site = box_site(parts, crane=test_crane(base=(8.0, -3.0, 0.0), jib=40.0, height=14.0))
    preparation = prepare(site)
    plan = plan_lifts(site, preparation)
    request = RevisionRequest(site, preparation)
    asked = []

    @contextmanager
    def here(function):
        asked.append(os.getpid())
        yield function

    def made():
        draft = RevisionDraft(lifts=list(plan.lifts), laid=dict.fromkeys(range(5)))
        return motions.made_in_full(request, draft).motions

    copied = made()
    monkeypatch.setattr(motions, "in_a_copy", here)
    own = made()
    assert asked
    assert list(copied) == list(own) == [0, 1, 2, 3, 4]
    for order, motion in own.items():
        other = copied[order]
        assert (other.phases, other.start_ns) == (motion.phases, motion.start_ns)
        for one, two in zip(other.trajectories, motion.trajectories, strict=True):
            assert np.array_equal(one.time_ns, two.time_ns)
            assert np.array_equal(one.axes, two.axes)
            assert not one.time_ns.flags.writeable
