"""A whole plan carried out in traffic, and its proof from the samples alone."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from planned_sites import planned, portal_crane, portal_site

from bimvox.live.deciders import Rules, stop_and_wait
from bimvox.live.execution import Execution, carried_out
from bimvox.live.tracks import Track, Traffic
from bimvox.live.traffic import DENSITIES, Density
from bimvox.planning.order_search import prepare
from bimvox.proof.carried_out import check_carried_out, planned_axes, tally_of
from bimvox.proof.motion import verify_motions
from bimvox.proof.plan import verify_plan
from bimvox.records.motion import CarriedOut, OtherKind, Tally

NOBODY = Traffic(Density(0, 0), 0)


@pytest.fixture(scope="module")
def portal():
    site = portal_site(portal_crane())
    plan, motions = planned(site)
    return plan, prepare(site), motions


def record_of(done: Execution) -> CarriedOut:
    axes = planned_axes(done.motions, done.plan_ns)
    times = (done.time_ns, done.plan_ns, done.pace, axes, done.place_m, done.seen_m)
    found = CarriedOut("test", "test", done.others, *times, Tally(0, 0.0, 0, 0, None, 0))
    return dataclasses.replace(found, tally=tally_of(done.plan, done.motions, found))


def test_without_others_the_plan_is_carried_out_as_planned(portal):
    plan, _, motions = portal
    done = carried_out(*portal, NOBODY, stop_and_wait)
    assert [lift.component for lift in done.plan.lifts] == [lift.component for lift in plan.lifts]
    assert done.plan_ns[-1] == motions[-1].end_ns == done.motions[-1].end_ns
    assert (done.moved, done.violations, done.held_s) == (0, 0, 0.0)
    tally = record_of(done).tally
    assert (tally.delivered, tally.stops, tally.waits, tally.least_m, tally.violations) == (4, 0, 0, None, 0)
    assert 0.0 <= tally.lost_s < 2.0 * len(motions)  # the parts of a lift begin with ticks of 0.5 s


@pytest.mark.parametrize("seed", range(12))
def test_what_is_carried_out_among_others_is_proven_from_its_samples(portal, seed):
    done = carried_out(*portal, Traffic(DENSITIES["heavy"], seed), Rules())
    found = record_of(done)
    delivered, lifts = found.tally.delivered, len(portal[2])
    failures: list[str] = []
    for check in check_carried_out(done.plan, done.motions, found):
        failures += check.failures
        assert check.samples
    told = f"lifts are left: {delivered} of {lifts} were carried out before the samples end"
    assert failures == ([] if delivered == lifts else [told])
    assert found.tally.violations == done.violations == 0
    assert len(done.others) == 5
    assert delivered == lifts or done.time_ns[-1] > 3 * portal[2][-1].end_ns


def test_lifts_that_change_places_are_timed_and_proven_in_their_own_order(portal):
    """Somebody stands at the first column, so the other one is set first."""
    plan, _, motions = portal
    at = motions[0].loaded.axes[0]
    pick_m = np.array(plan.site.cranes[0].base_m[:2]) + at[1] * np.array([np.cos(at[0]), np.sin(at[0])])
    samples = [(0.0, *pick_m.tolist()), (900.0, *pick_m.tolist()), (1000.0, *(pick_m - 30.0).tolist())]
    away = Track("bob", OtherKind.PERSON, samples)
    done = carried_out(*portal, dataclasses.replace(NOBODY, tracks=(away,)), Rules())
    assert done.moved == 2
    assert [lift.order for lift in done.plan.lifts] == [motion.order for motion in done.motions] == [0, 1, 2, 3]
    assert done.motions[0].component == motions[1].component
    assert done.motions[0].approach is None
    assert verify_plan(done.plan).verified
    assert verify_motions(done.plan, done.motions).verified
    assert all(check.passed for check in check_carried_out(done.plan, done.motions, record_of(done)))
    pinned = carried_out(*portal, dataclasses.replace(NOBODY, tracks=(away,)), Rules(), [motions[0].component])
    assert pinned.moved == 0
