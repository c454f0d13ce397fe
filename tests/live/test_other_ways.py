from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from box_sites import box_site, test_crane
from planned_sites import PORTAL, planned

from bimvox.crane.kinematics import hook_of
from bimvox.live.other_ways import lift_ways
from bimvox.live.planned import job_of
from bimvox.planning.order_search import prepare
from bimvox.proof.motion import verify_motions
from bimvox.proof.plan import verify_plan
from bimvox.records.motion import PhaseName


@pytest.fixture(scope="module")
def portal():
    crane = test_crane(base=(18.0, -3.0, 0.0), jib=50.0, height=12.0)
    site = box_site(PORTAL, shape=(80, 60, 24), yard=((50.0, 0.0), (80.0, 60.0)), crane=crane)
    plan, motions = planned(site)
    return plan, prepare(site), motions


@pytest.fixture(scope="module")
def ways(portal):
    plan, preparation, motions = portal
    return lift_ways(plan, preparation, motions, [motion.order for motion in motions], 3)


def hook_m(plan, motion):
    return hook_of(plan.site.cranes[0], *motion.loaded.axes.T)[:, :2]


def middle_m(plan, motion):
    along = hook_m(plan, motion)
    length_m = np.r_[0.0, np.cumsum(np.hypot(*np.diff(along, axis=0).T))]
    return along[np.searchsorted(length_m, 0.5 * length_m[-1])]


def test_the_planned_way_is_the_first(portal, ways):
    plan, _, motions = portal
    lifts = {lift.order: lift for lift in plan.lifts}
    assert list(ways) == [motion.order for motion in motions]
    for motion in motions:
        assert ways[motion.order][0] == (lifts[motion.order], motion)


def test_other_ways_lead_around_the_middle_of_the_planned_one(portal, ways):
    plan, size_m = portal[0], portal[0].site.frame.voxel_size_m
    pairs = [(own[n], own[0]) for own in ways.values() for n in range(1, len(own))]
    assert len(pairs) >= 4
    for way, first in pairs:
        ends = hook_m(plan, first.motion)[[0, -1]]
        apart_m = min(12.0, 0.25 * np.hypot(*(ends[1] - ends[0])))
        away_m = np.hypot(*(hook_m(plan, way.motion) - middle_m(plan, first.motion)).T)
        assert away_m.min() > apart_m - size_m
        assert way.motion.end_ns <= first.motion.end_ns + 60e9
        np.testing.assert_array_equal(way.lift.last_moves_vox, first.lift.last_moves_vox)
        assert not way.lift.path_vox.flags.writeable


def test_the_empty_hook_comes_as_planned(ways):
    for own in ways.values():
        for way in own[1:]:
            starts = [
                {phase.name: phase.start_ns for phase in motion.phases}[PhaseName.RAISE]
                for motion in (own[0].motion, way.motion)
            ]
            assert starts[0] == starts[1]


def test_a_plan_with_any_one_other_way_is_proven(portal, ways):
    plan, _, motions = portal
    last = motions[-1].order
    assert len(ways[last]) > 1
    for lift, motion in ways[last][1:]:  # no later motion would have to start later
        other = dataclasses.replace(plan, lifts=tuple(lift if one.order == last else one for one in plan.lifts))
        assert verify_plan(other).verified
        assert verify_motions(other, (*motions[:-1], motion)).verified


def test_what_is_not_proven_is_left_out(portal, monkeypatch):
    plan, preparation, motions = portal
    monkeypatch.setattr("bimvox.live.other_ways._is_proven", lambda plan, way: way.lift.order != motions[0].order)
    found = lift_ways(plan, preparation, motions, [motion.order for motion in motions], 2)
    assert [len(own) for own in found.values()] == [1, 2, 2, 2]


def test_a_job_offers_the_ways(portal, ways):
    job = job_of(*portal, ways=3)
    assert [len(lift.ways) for lift in job.lifts] == [len(own) for own in ways.values()]
    assert job.undisturbed_s == job_of(*portal).undisturbed_s
    for lift, planned_one in zip(job.lifts, job_of(*portal).lifts, strict=True):
        assert planned_one.earlier <= lift.earlier
