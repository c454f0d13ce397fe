from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest
from box_sites import box_site, test_crane

from bimvox.crane.tower_crane import CranePose
from bimvox.crane.travel import Travel, point_to_point_s
from bimvox.cranes.schedule import time_lifts
from bimvox.planning.contact.pairs import Contacts
from bimvox.planning.order.faster_order import order_and_yard, searched, travel_s
from bimvox.planning.order.makespan import (
    COLUMNS,
    NOTHING_APART,
    NOTHING_BESIDE,
    OrderTimes,
    course_of,
    makespan_s,
    walk,
)
from bimvox.planning.order.relations import precedence
from bimvox.planning.order.sequence import Sequencer
from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.planning.yard import allocate_yard
from bimvox.proof.motion import verify_motions
from bimvox.proof.plan import verify_plan
from bimvox.site.component import OrderHints
from bimvox.site.site import Rules, Site, SwingRule

POSTS = [
    (f"p{n}", (x, y, 0.0), (x + 1.0, y + 0.5, 2.0))
    for n, (x, y) in enumerate([(1, 1), (8, 12), (2, 2), (7, 11), (1, 4)])
]
CRANE = test_crane(base=(9.5, 6.0, 0.0))


def site_of(**more):
    return box_site(POSTS, yard=((22.0, 0.0), (40.0, 30.0)), crane=CRANE, **more)


def travel_of(site):
    return Travel(site.cranes[0], 60.0)


def test_a_looked_up_travel_takes_as_long_as_the_bound():
    travel = Travel(CRANE, 60.0)
    generator = np.random.default_rng(3)
    for _ in range(50):
        slew, radius, height = generator.uniform(-3, 3, 2), generator.uniform(3, 40, 2), generator.uniform(0, 25, 2)
        start, end = (CranePose(slew[n], radius[n], height[n]) for n in (0, 1))
        found = travel.between_s(*((np.array(slew[n]), np.array(radius[n]), np.array(height[n])) for n in (0, 1)))
        assert float(found) == pytest.approx(point_to_point_s(CRANE, start, end, 0.0), abs=0.3)


def test_order_and_places_are_shorter_than_lowest_first_and_first_fit():
    site = site_of()
    contacts = Contacts(site)
    sequencer = Sequencer(site, precedence(site, contacts), contacts)
    plain = sequencer.lowest_first()
    before = travel_s(site, travel_of(site), plain.order, allocate_yard(site, plain.order))
    sequence, places = order_and_yard(site, sequencer)
    assert sorted(sequence.order) == list(range(5))
    assert all(place is not None for place in places)
    assert travel_s(site, travel_of(site), sequence.order, places) < 0.9 * before


def test_the_same_site_gives_the_same_order_and_places():
    one, other = prepare(site_of()), prepare(site_of())
    assert one.sequence.order == other.sequence.order
    assert [p.cell_vox for p in one.places] == [p.cell_vox for p in other.places]


def test_without_a_crane_the_lowest_comes_first_and_the_first_place_is_taken():
    site = box_site(POSTS, yard=((22.0, 0.0), (40.0, 30.0)))
    preparation = prepare(site)
    assert preparation.sequence.order == (0, 4, 2, 3, 1)
    assert preparation.places[0].cell_vox == (22, 0, 1)


def test_parts_of_one_assembly_follow_each_other():
    hints = [OrderHints(assembly="a"), OrderHints(assembly="b")]
    site = site_of()
    components = tuple(dataclasses.replace(c, hints=hints[c.index % 2]) for c in site.components)
    order = prepare(dataclasses.replace(site, components=components)).sequence.order
    groups = [i % 2 for i in order]
    assert sum(a != b for a, b in itertools.pairwise(groups)) == 1


def times_of(count: int, *, cranes: int = 1, seed: int = 1, under: tuple[int, ...] = ()) -> OrderTimes:
    """Return random times; the last part rests on ``under``, which carry an hour after they are set."""
    random = np.random.default_rng(seed)
    hold_s = np.zeros(count)
    hold_s[list(under)] = 3600.0
    return OrderTimes(
        np.arange(count, dtype=np.int64) % cranes,
        np.arange(count)[:, None] % cranes == np.arange(cranes),
        np.zeros(count, np.int64),
        np.repeat(random.uniform(10.0, 60.0, (1, count, count)), cranes, axis=0),
        random.uniform(60.0, 90.0, count),
        np.repeat(random.uniform(40.0, 120.0, (1, count)), cranes, axis=0),
        random.uniform(60.0, 300.0, count),
        hold_s,
        np.zeros(count),
        np.full(count, 2, np.int64),
        np.array([0] * count + [len(under)], np.int64),
        np.array(under, np.int64),
        NOTHING_APART,
        np.abs(np.subtract.outer(np.arange(count), np.arange(count))) == 1 if cranes > 1 else NOTHING_BESIDE,
    )


def test_one_crane_takes_the_sum_of_its_moves_and_times() -> None:
    times = times_of(5)
    order = (3, 1, 4, 0, 2)
    own_s = times.lead_s + times.carry_s[0] + times.off_s
    empty_s = sum(times.empty_s[0, a, b] for a, b in itertools.pairwise(order))
    assert makespan_s(times, order) == pytest.approx(own_s.sum() + empty_s)


def test_several_cranes_keep_the_turns_of_the_sequence() -> None:
    """The same rules as in the schedule, written for times instead of motions."""
    times = times_of(8, cranes=2)
    times = times._replace(delivery=np.arange(8, dtype=np.int64) // 4)
    raised_s, set_s, released_s = {}, {}, {}
    for i in range(8):
        hooked_s = max([released_s[i - 2] + times.empty_s[0, i - 2, i] if i > 1 else 0.0, *raised_s.values()])
        over_s = [r if times.beside[i, j] else set_s[j] for j, r in released_s.items()]
        hooked_s = max([hooked_s, *(r - times.lead_s[i] - times.carry_s[0, i] for r in over_s)])
        hooked_s = max([hooked_s, *(r for j, r in released_s.items() if j // 4 < i // 4)])
        raised_s[i] = hooked_s + times.lead_s[i]
        set_s[i] = raised_s[i] + times.carry_s[0, i]
        released_s[i] = set_s[i] + times.off_s[i]
    assert makespan_s(times, range(8)) == pytest.approx(max(released_s.values()))
    own_s = (times.lead_s + times.carry_s[0] + times.off_s).sum()
    assert max(released_s.values()) < own_s


def test_a_part_waits_until_what_it_rests_on_carries() -> None:
    times = times_of(4, under=(0,))
    set_s = times.lead_s[0] + times.carry_s[0, 0] + times.off_s[0]
    own_s = times.lead_s[3] + times.carry_s[0, 3] + times.off_s[3]
    expected_s = set_s + 3600.0 + times.empty_s[0, 2, 3] + own_s
    assert makespan_s(times, range(4)) == pytest.approx(expected_s)


@pytest.mark.parametrize("under", [(), (2, 5)])
@pytest.mark.parametrize("cranes", [1, 2])
def test_a_walk_from_the_middle_ends_as_one_from_the_start(cranes: int, under: tuple[int, ...]) -> None:
    times, count = times_of(12, cranes=cranes, under=under), 12
    order, known, trial = np.arange(count), course_of(count, cranes), course_of(count, cranes)
    walk(times, times.crane, order, (0, count), known, known)
    new = order.copy()
    new[[3, 5]] = new[[5, 3]]
    until = walk(times, times.crane, new, (3, 6), known, trial)
    at = known.states.shape[1] - COLUMNS + 1
    later_s = trial.states[until, at] - known.states[until, at]
    assert known.states[count, at] + later_s == pytest.approx(makespan_s(times, new.tolist()))


def test_what_comes_later_holds_nothing_up() -> None:
    """A floor at the feet of a part holds it up only if it is set before it; a course is written over and over."""
    times, order = times_of(4, under=(1,)), np.array([0, 1, 2, 3])
    known, trial = course_of(4, 1), course_of(4, 1)
    walk(times, times.crane, order, (0, 4), known, known)
    walk(times, times.crane, order, (0, 4), known, trial)
    before = np.array([0, 3, 2, 1])
    walk(times, times.crane, before, (1, 4), known, trial)
    at = trial.states.shape[1] - COLUMNS + 1
    own_s = (times.lead_s + times.carry_s[0] + times.off_s).sum()
    empty_s = sum(times.empty_s[0, a, b] for a, b in itertools.pairwise(before.tolist()))
    assert trial.states[-1, at] == pytest.approx(own_s + empty_s) == makespan_s(times, before.tolist())


def test_the_search_finds_the_fastest_of_all_orders_that_keep_the_fixed_pairs() -> None:
    times, fixed = times_of(7, seed=5), np.zeros((7, 7), np.bool_)
    fixed[0, 6] = fixed[2, 5] = True
    legal = [p for p in itertools.permutations(range(7)) if p.index(0) < p.index(6) and p.index(2) < p.index(5)]
    fastest_s = min(makespan_s(times, order) for order in legal)
    found, cranes = searched(times, range(7), fixed, 200_000, 3, 5.0)
    assert cranes == (0,) * 7
    assert found in legal
    assert makespan_s(times, found) == pytest.approx(fastest_s)
    assert found == searched(times, range(7), fixed, 200_000, 3, 5.0)[0]


def test_parts_go_to_a_crane_that_may_lift_them_if_that_is_faster() -> None:
    times = times_of(10, cranes=2)
    times = times._replace(crane=np.zeros(10, np.int64), may=np.ones((10, 2), np.bool_))
    times.may[3] = True, False
    alone_s, order = makespan_s(times, range(10)), tuple(range(10))
    found, cranes = searched(times, order, np.zeros((10, 10), np.bool_), 100_000, 1, 5.0)
    both = times._replace(crane=np.array(cranes))
    assert sorted(found) == list(order)
    assert cranes[3] == 0
    assert 3 <= sum(cranes) <= 7
    assert makespan_s(both, found) < 0.8 * alone_s
    fixed = np.triu(np.ones((10, 10), np.bool_), 1)
    assert searched(times, order, fixed, 100_000, 1, 5.0)[0] == order
    assert sum(searched(times, order, fixed, 100_000, 1, 5.0)[1]) >= 3


def test_nothing_moves_if_every_pair_is_fixed() -> None:
    times, order = times_of(6), (4, 1, 0, 5, 3, 2)
    assert searched(times, order, np.ones((6, 6), np.bool_), 5_000, 1, 50.0)[0] == order


LOCAL_POSTS = [
    (f"p{n}", (x, y, 0.0), (x + 0.5 + 0.1 * (n % 3), y + 0.5, 2.0), {"hints": OrderHints(storey_rank=n // 5)})
    for n, (x, y) in enumerate([(1, 1), (8, 12), (2, 3), (7, 10), (1, 5), (5, 1), (3, 12), (8, 5), (2, 8), (5, 7)])
]


def sequencer_of(site: Site) -> Sequencer:
    contacts = Contacts(site)
    return Sequencer(site, precedence(site, contacts), contacts)


def test_stages_stay_apart_and_the_sequencer_keeps_what_was_found() -> None:
    site = box_site(LOCAL_POSTS, yard=((22.0, 0.0), (40.0, 30.0)), crane=CRANE)
    sequencer = sequencer_of(site)
    order = sequencer.lowest_first().order
    fixed = sequencer.fixed_pairs(order)
    assert fixed[:5, 5:].all()
    assert not fixed[:5, :5].any()
    changed = (*reversed(order[:5]), *reversed(order[5:]))
    assert sequencer.following(changed).order == changed
    assert sequencer.following(order[::-1]).order == changed  # storey by storey all the same


def test_before_and_after_of_the_site_file_are_fixed() -> None:
    parts = [
        *LOCAL_POSTS[:4],
        ("p4", (1, 5, 0.0), (1.5, 5.5, 2.0), {"before": ("p0",), "hints": OrderHints(storey_rank=0)}),
    ]
    site = box_site(parts, yard=((22.0, 0.0), (40.0, 30.0)), crane=CRANE)
    sequencer = sequencer_of(site)
    assert sequencer.fixed_pairs(sequencer.lowest_first().order)[4, 0]


def crane_time_ns(site: Site) -> int:
    preparation = prepare(site)
    plan = plan_lifts(site, preparation)
    assert all(lift.path_vox is not None for lift in plan.lifts)
    motions = time_lifts(plan, preparation)
    assert verify_plan(plan).verified
    assert verify_motions(plan, motions).verified
    return max(motion.end_ns for motion in motions)


def test_the_searched_order_takes_less_time_on_the_clock_and_can_be_left_out() -> None:
    cells = np.stack(np.unravel_index(np.random.default_rng(3).choice(48, 12, replace=False), (6, 8)), axis=1)
    parts = [
        (f"p{n}", (x, y, 0.0), (x + 0.5 + 0.2 * (n % 3), y + 0.5, 2.0), {"hints": OrderHints(storey_rank=n // 6)})
        for n, (x, y) in enumerate((1.0 + 1.5 * cells).tolist())
    ]
    # The search does not know how moves are shaped against swing, which takes seconds more or less for a lift.
    rules = Rules(swing=SwingRule.OFF)
    site = box_site(parts, yard=((26.0, 2.0), (38.0, 28.0)), crane=test_crane(base=(9.5, -4.0, 0.0)), rules=rules)
    greedy = dataclasses.replace(site, rules=dataclasses.replace(site.rules, order_search=False))
    assert prepare(site).sequence.order != prepare(greedy).sequence.order
    assert crane_time_ns(site) < crane_time_ns(greedy)
