from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from planned_sites import planned, portal_crane, portal_site

from bimvox.errors import InputError
from bimvox.live.deciders import stop_and_wait
from bimvox.live.episode import Episode, Stage
from bimvox.live.planned import job_of
from bimvox.live.traffic import Density
from bimvox.live.way import TICK_S, seconds_of
from bimvox.planning.order_search import prepare
from bimvox.records.motion import PhaseName


@pytest.fixture(scope="module")
def portal():
    site = portal_site(portal_crane())
    plan, motions = planned(site)
    return plan, prepare(site), motions


def test_a_job_has_the_times_and_the_places_of_the_plan(portal):
    plan, preparation, motions = portal
    job = job_of(plan, preparation, motions)
    assert [lift.number for lift in job.lifts] == [motion.number for motion in motions]
    for lift, motion in zip(job.lifts, motions, strict=True):
        raised_ns = next(phase.start_ns for phase in motion.phases if phase.name is PhaseName.RAISE)
        assert seconds_of(lift.ways[0]) == pytest.approx((motion.set_ns - raised_ns) / 1e9, abs=TICK_S)
        assert lift.ways[0].rests[0]
        assert lift.ways[0].rests[-1]
    assert job.undisturbed_s == pytest.approx(motions[-1].end_ns / 1e9, abs=len(motions) * TICK_S + 30.0)
    crane, (slew, radius, _) = plan.site.cranes[0], motions[0].loaded.axes[-1]
    place_m = np.array(crane.base_m[:2]) + radius * np.array([np.cos(slew), np.sin(slew)])
    np.testing.assert_allclose(job.lifts[0].ways[0].hook_m[-1], place_m, atol=1e-6)


def test_what_carries_comes_first(portal):
    plan, preparation, motions = portal
    job = job_of(plan, preparation, motions)
    names = [lift.name for lift in job.lifts]
    beam, slab = names.index("beam"), names.index("slab")
    assert {names.index("left"), names.index("right")} <= job.lifts[beam].earlier
    assert beam in job.lifts[slab].earlier


def test_without_others_the_plan_is_carried_out_in_its_time(portal):
    job = job_of(*portal)
    episode = Episode(job, Density(0, 0), 0)
    while episode.stage is not Stage.OVER:
        episode.decide(stop_and_wait(episode))
    assert abs(episode.lost_s) < 3.0
    assert episode.done == [0, 1, 2, 3]


def test_what_has_no_job_is_refused(portal):
    plan, preparation, motions = portal
    with pytest.raises(InputError, match="one crane and a planned lift number 10"):
        job_of(plan, preparation, motions, first=9)
    two = dataclasses.replace(plan, site=dataclasses.replace(plan.site, cranes=plan.site.cranes * 2))
    with pytest.raises(InputError, match="one crane"):
        job_of(two, preparation, motions)
