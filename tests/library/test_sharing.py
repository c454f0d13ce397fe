"""Several processes plan, time, prove and revise exactly what one does."""

from __future__ import annotations

import time
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest
from box_sites import box_site, test_crane
from guided_sites import bays_of_slabs
from two_cranes import two_crane_site

from bimvox.library.obstructions import rasterise
from bimvox.library.prove import plan_and_prove, prepared
from bimvox.library.sharing import constants_of, workers_of
from bimvox.motion.time_plan import time_plan
from bimvox.planning.ahead import LiftSearches, foretold
from bimvox.planning.contact.pairs import Contacts
from bimvox.planning.planner import plan_lifts
from bimvox.policy.choice import NO_POLICY
from bimvox.progress import SilentProgress
from bimvox.records.lift import Status
from bimvox.revision.current_plan import RevisionRequest, current_plan_of
from bimvox.revision.revise import revise
from bimvox.site.build import with_digests, with_obstructions
from bimvox.site.obstructions.obstruction_set import Box, Obstruction, ObstructionSet
from bimvox.workers import ALONE, Workers

QUIET = SilentProgress()


@pytest.fixture(scope="module")
def site():
    """12 blocks on 12 blocks, without other means: what cannot be lifted is not set, and nothing stands on it."""
    parts = [
        (f"{'low' if z == 0.0 else 'high'} {x:g} {y:g}", (x, y, z), (x + 1.0, y + 1.0, z + 1.0))
        for z in (0.0, 1.0)
        for x in (2.0, 4.0, 6.0, 8.0)
        for y in (2.0, 4.0, 6.0)
    ]
    made = box_site(parts, crane=test_crane(base=(8.0, -3.0, 0.0), jib=40.0, height=14.0), shape=(60, 40, 24))
    return with_digests(replace(made, rules=replace(made.rules, by_other_means=False)))


@contextmanager
def processes(count):
    """So many processes, all of them ready."""
    workers = Workers(count, (plan_lifts, time_plan))
    begun = workers.begin(time.sleep, [(0.2,)] * (count - 1))
    until_s = time.monotonic() + 60.0
    while not begun.is_finished and time.monotonic() < until_s:
        time.sleep(0.02)
    assert begun.is_finished, "the other processes are ready"
    begun.finished()
    yield workers
    assert workers.count == count, "no task failed"
    workers.close()


@pytest.fixture(scope="module")
def two():
    with processes(2) as workers:
        yield workers


def blocked(site):
    """The site with a box where two of the low blocks are to stand."""
    box = Obstruction("box", Box((4.1, 2.1, 0.1), (4.9, 4.9, 0.9)))
    return with_obstructions(site, ObstructionSet.of([box]), rasterise)


def alike(one, other):
    """Whether two plans with their motions are the same, to the bit."""
    lifts = zip(one.plan.lifts, other.plan.lifts, strict=True)
    for a, b in lifts:
        assert (a.component, a.status, a.reason, a.blocked_by, a.method, a.guide) == (
            b.component, b.status, b.reason, b.blocked_by, b.method, b.guide,
        )  # fmt: skip
        assert (a.path_vox is None) == (b.path_vox is None)
        assert a.path_vox is None or np.array_equal(a.path_vox, b.path_vox)
    for a, b in zip(one.motions, other.motions, strict=True):
        assert (a.order, a.phases, a.start_ns, a.end_ns) == (b.order, b.phases, b.start_ns, b.end_ns)
        for way, same in zip(a.trajectories, b.trajectories, strict=True):
            assert way.axes.tobytes() == same.axes.tobytes()
            assert way.time_ns.tobytes() == same.time_ns.tobytes()
    return True


@pytest.mark.parametrize("place", ["free", "blocked"])
def test_two_processes_plan_what_one_does(site, two, place):
    own = blocked(site) if place == "blocked" else site
    own, preparation = prepared(own, QUIET)
    alone = plan_and_prove(own, preparation, NO_POLICY, progress=QUIET)
    with two.knowing(*constants_of(own, preparation)):
        shared = plan_and_prove(own, preparation, NO_POLICY, progress=QUIET, workers=two)
    assert alike(alone, shared)
    assert alone.verdict == shared.verdict
    refused = [lift for lift in alone.plan.lifts if lift.status is Status.INFEASIBLE]
    assert bool(refused) == (place == "blocked")
    places = {id(place) for place in preparation.places}
    assert all(id(lift.place) in places for lift in shared.plan.lifts if lift.place is not None)


@pytest.fixture(scope="module")
def guided():
    """Slabs that crews guide to their places, as one process plans them."""
    own, preparation = prepared(with_digests(bays_of_slabs()), QUIET)
    return own, preparation, plan_and_prove(own, preparation, NO_POLICY, progress=QUIET)


def test_any_number_of_processes_plans_the_same_guides(guided, two):
    own, _, alone = guided
    assert sum(lift.guide is not None for lift in alone.plan.lifts) >= 10
    with processes(3) as three:
        for workers in (two, three):
            own, preparation = prepared(own, QUIET, workers)
            with workers.knowing(*constants_of(own, preparation)):
                shared = plan_and_prove(own, preparation, NO_POLICY, progress=QUIET, workers=workers)
            assert alike(alone, shared)
            assert shared.verdict == alone.verdict


@pytest.mark.parametrize("backward", [False, True])
def test_guides_do_not_depend_on_which_lifts_are_searched_first(guided, backward):
    """Whoever searches a chunk has searched others before it, or none."""
    own, preparation, alone = guided
    anew = replace(preparation, contacts=Contacts(own))
    told = tuple(lift.is_set for lift in alone.plan.lifts)
    chunks = [range(first, first + 3) for first in range(0, len(told), 3)]
    found = {}
    for chunk in reversed(chunks) if backward else chunks[1::2]:
        for lift in LiftSearches(own, anew, (), told).lifts(chunk):
            found[lift.order] = lift
    assert {n: lift.guide for n, lift in found.items()} == {n: alone.plan.lifts[n].guide for n in found}
    assert all(np.array_equal(lift.path_vox, alone.plan.lifts[n].path_vox) for n, lift in found.items())


def test_two_processes_plan_two_cranes_as_one_does(two):
    own = two_crane_site()
    own, preparation = prepared(own, QUIET)
    alone = plan_and_prove(own, preparation, NO_POLICY, progress=QUIET)
    with two.knowing(*constants_of(own, preparation)):
        shared = plan_and_prove(own, preparation, NO_POLICY, progress=QUIET, workers=two)
    assert alike(alone, shared)
    assert alone.verdict == shared.verdict
    assert {"cranes", "turns"} <= {check.name for check in shared.verdict.checks if check.samples}


@pytest.mark.parametrize("now_s", [None, 400])
def test_two_processes_revise_two_cranes_as_one_does(two, now_s):
    own = two_crane_site()
    own, preparation = prepared(own, QUIET)
    made = plan_and_prove(own, preparation, NO_POLICY, progress=QUIET)
    path_vox = made.plan.lifts[-1].path_vox
    low = own.frame.corner_of(path_vox[len(path_vox) // 2]) + 0.1
    there = with_obstructions(
        own, ObstructionSet.of([Obstruction("box", Box(tuple(low), tuple(low + 0.3)))]), rasterise
    )
    current, now_ns = current_plan_of(made.plan, made.motions), None if now_s is None else now_s * 10**9
    found = []
    with two.knowing(*constants_of(own, preparation)):
        for workers in (ALONE, two):
            (part,) = revise(current, RevisionRequest(there, preparation, now_ns=now_ns, workers=workers))
            found.append(replace(made, plan=part.current.plan, motions=part.current.chain))
    assert not np.array_equal(found[0].plan.lifts[-1].path_vox, path_vox)
    assert alike(*found)


def test_what_turns_out_otherwise_than_foretold_is_searched_again(site):
    own = blocked(site)
    own, preparation = prepared(own, QUIET)
    plan = plan_lifts(own, preparation)
    told = foretold(own, preparation, [])
    assert [lift.is_set for lift in plan.lifts] != list(told), "the box blocks paths, which nobody foretells"
    assert foretold(own, preparation, plan.lifts) == tuple(lift.is_set for lift in plan.lifts)


def test_two_processes_revise_as_one_does(site, two):
    site, preparation = prepared(site, QUIET)
    made = plan_and_prove(site, preparation, NO_POLICY, progress=QUIET)
    current, there = current_plan_of(made.plan, made.motions), blocked(site)
    found = []
    with two.knowing(*constants_of(site, preparation)):
        for workers in (ALONE, two):
            parts = list(revise(current, RevisionRequest(there, preparation, first=4, workers=workers)))
            found.append(parts)
    assert [(part.made, part.replanned, part.retimed) for part in found[0]] == [
        (part.made, part.replanned, part.retimed) for part in found[1]
    ]
    assert len(found[0]) > 1
    last = [replace(made, plan=parts[-1].current.plan, motions=parts[-1].current.chain) for parts in found]
    assert alike(*last)


def test_few_parts_are_planned_without_workers(site):
    with workers_of(site, None) as workers:
        assert workers is ALONE
    with workers_of(replace(site, components=site.components * 5), 1) as workers:
        assert workers is ALONE
    several = two_crane_site()
    for times, is_alone in ((7, True), (8, False)):  # 49 and 56 parts
        with workers_of(replace(several, components=several.components * times), 2) as workers:
            assert (workers is ALONE) is is_alone
