"""The separation of cranes in the estimate of an order."""

from __future__ import annotations

import dataclasses
import itertools
import tracemalloc

import numpy as np
import pytest
from named_cranes import default_crane
from two_cranes import two_crane_site

from bimvox.crane.travel import Travel
from bimvox.cranes.schedule import time_lifts
from bimvox.planning.order.faster_order import FasterOrder, travel_of
from bimvox.planning.order.makespan import Apart, OrderTimes, makespan_s, waits_s, whole_seconds
from bimvox.planning.order.sequence import Sequencer
from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.planning.preparation import Preparation
from bimvox.site.site import Site


def times_of(site: Site, preparation: Preparation) -> OrderTimes:
    sequencer = Sequencer(site, preparation.relations, preparation.contacts)
    search = FasterOrder(site, sequencer, preparation.relations, [travel_of(site, crane) for crane in site.cranes])
    return search.problem(preparation.sequence, preparation.places)[0]


def waits_of(apart: Apart, site: Site, one: str, other: str) -> float:
    numbers = {part.id: (part.crane, part.index) for part in site.components}
    return float(waits_s(apart, numbers[one], numbers[other]))


def test_a_crane_waits_only_for_one_that_it_would_meet_in_the_middle() -> None:
    site = two_crane_site()
    apart = times_of(site, prepare(site)).apart
    assert waits_of(apart, site, "west left", "east right") == -np.inf
    assert waits_of(apart, site, "east right", "west left") == -np.inf
    assert waits_of(apart, site, "west bridge", "east beam") > -200.0
    assert np.isfinite(apart.meets_s).any()
    assert np.isnan(apart.meets_s).any()


def test_with_one_crane_nothing_is_kept_apart() -> None:
    site = two_crane_site()
    parts = tuple(dataclasses.replace(part, crane=0) for part in site.components)
    alone = dataclasses.replace(site, cranes=site.cranes[:1], components=parts)
    assert times_of(alone, prepare(alone)).apart.meets_s.size == 0


@pytest.mark.slow
def test_orders_are_ranked_as_by_their_schedules() -> None:
    site = two_crane_site(crane_separation_m=4.0)
    known = prepare(site)
    sequencer = Sequencer(site, known.relations, known.contacts)
    orders = sorted({sequencer.following(one).order for one in itertools.permutations(range(7))})
    found, far = [], []
    for order in orders[:: max(1, len(orders) // 12)]:
        sequence = sequencer.following(order)
        made = dataclasses.replace(known, sequence=sequence)
        times = times_of(site, made)
        scheduled_s = max(motion.end_ns for motion in time_lifts(plan_lifts(site, made), made)) / 1e9
        without = times._replace(apart=times.apart._replace(meets_s=times.apart.meets_s[:0]))
        found.append((makespan_s(times, order), scheduled_s))
        far.append((makespan_s(without, order), scheduled_s))
    ranks = [np.argsort(np.argsort(np.array(pairs), axis=0), axis=0).T for pairs in (found, far)]
    near, ignored = (float(np.corrcoef(*pair)[0, 1]) for pair in ranks)
    assert near > 0.8
    assert near >= ignored


def test_travel_times_of_all_pairs_need_little_more_memory_than_they_have() -> None:
    travel = Travel(default_crane("hammerhead-75", (0.0, 0.0, 0.0), 40.0), 100.0)
    points_m = np.random.default_rng(0).uniform((5.0, -40.0, 0.0), (40.0, 40.0, 30.0), (2, 700, 3))
    start, end = (travel.axes_of(points) for points in points_m)
    tracemalloc.start()
    found = whole_seconds(travel, start, end)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    alone = [travel.between_s((start[0][i], start[1][i], start[2][i]), end) for i in range(700)]
    assert np.array_equal(found, np.round(alone))
    assert found.max() > found.min() > 0.0
    assert peak < 2.5 * found.nbytes
