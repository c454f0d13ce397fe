"""A lift that is proven is proven again only if it, or anything around it, changed."""

import dataclasses

import pytest
from planned_sites import planned, portal_crane, portal_site

from bimvox.motion.trajectories import chained
from bimvox.proof import motion as motion_proof
from bimvox.proof import plan as proof
from bimvox.proof.motion import verify_motions
from bimvox.proof.plan import verify_plan
from bimvox.records.lift import Status
from bimvox.walk import Store


@pytest.fixture(scope="module")
def made():
    return planned(portal_site(portal_crane()))[0]


@pytest.fixture
def looked_at(monkeypatch):
    """Names of the lifts whose checks are run."""
    names, check_lift = [], proof._Verifier._check_lift

    def spied(self, lift, *more):
        names.append(self.site.components[lift.component].id)
        check_lift(self, lift, *more)

    monkeypatch.setattr(proof._Verifier, "_check_lift", spied)
    return names


def names_of(plan):
    return [plan.site.components[lift.component].id for lift in plan.lifts]


def changed(plan, number, **fields):
    lifts = [dataclasses.replace(lift, **fields) if lift.order == number else lift for lift in plan.lifts]
    return dataclasses.replace(plan, lifts=tuple(lifts))


def test_what_did_not_change_is_not_proven_again(made, looked_at):
    store = Store()
    first = verify_plan(made, store=store)
    assert first.verified
    assert looked_at == names_of(made)
    looked_at.clear()
    assert verify_plan(dataclasses.replace(made), store=store) == first == verify_plan(made)
    assert looked_at == names_of(made), "only by the proof that knows nothing"


def test_another_path_is_proven(made, looked_at):
    store = Store()
    verify_plan(made, store=store)
    looked_at.clear()
    path_vox = made.lifts[1].path_vox[[0, *range(2, len(made.lifts[1].path_vox))]]
    other = changed(made, 1, path_vox=path_vox)
    found = verify_plan(other, store=store)
    assert looked_at == [names_of(made)[1]]
    assert not found.verified
    assert found == verify_plan(other)
    looked_at.clear()
    assert verify_plan(other, store=store) == found
    assert looked_at == [], "what failed fails again"


def test_with_something_else_in_place_all_that_follows_is_proven(made, looked_at):
    store = Store()
    verify_plan(made, store=store)
    looked_at.clear()
    other = changed(made, 1, status=Status.INFEASIBLE, path_vox=None, place=None, reason="no path")
    assert verify_plan(other, store=store) == verify_plan(other)
    first, _, *later = names_of(made)
    assert looked_at == 2 * [first, *later], "the part does not lie in the yard before the first lift either"


def test_what_is_proven_of_one_site_is_not_of_another(made, looked_at):
    store = Store()
    verify_plan(made, store=store)
    looked_at.clear()
    verify_plan(dataclasses.replace(made, site=dataclasses.replace(made.site)), store=store)
    assert looked_at == names_of(made)


@pytest.fixture(scope="module")
def driven():
    return planned(portal_site(portal_crane()))


@pytest.fixture
def driven_at(monkeypatch):
    """Numbers of the lifts whose motions are proven."""
    numbers, checks_of = [], motion_proof._Verifier._checks_of

    def spied(self, moment, *more):
        numbers.append(moment.lift.number)
        return checks_of(self, moment, *more)

    monkeypatch.setattr(motion_proof._Verifier, "_checks_of", spied)
    return numbers


def aside(motion):
    """Return a motion whose hook jumps aside for one sample."""
    radius_m = motion.loaded.radius_m.copy()
    radius_m[len(radius_m) // 2] += 0.5
    return dataclasses.replace(motion, loaded=dataclasses.replace(motion.loaded, radius_m=radius_m))


def test_a_motion_that_did_not_change_is_not_proven_again_wherever_it_starts(driven, driven_at):
    plan, motions = driven
    store = Store()
    first = verify_motions(plan, motions, store=store)
    assert first.verified
    assert first == verify_motions(plan, motions)
    assert driven_at == 2 * [1, 2, 3, 4]
    driven_at.clear()
    assert verify_motions(plan, chained(motions), store=store) == first
    assert driven_at == []
    late = tuple(dataclasses.replace(motion) for motion in motions)
    assert verify_motions(plan, late, store=store) == first
    assert driven_at == [], "the same trajectories at the same times are the same motion"


def test_a_motion_that_changed_is_proven_with_the_one_after_it(driven, driven_at):
    plan, motions = driven
    store = Store()
    verify_motions(plan, motions, store=store)
    driven_at.clear()
    other = (motions[0], aside(motions[1]), *motions[2:])
    found = verify_motions(plan, other, store=store)
    assert driven_at == [2, 3]
    assert not found.verified
    assert found == verify_motions(plan, other)
    driven_at.clear()
    assert verify_motions(plan, other, store=store) == found
    assert driven_at == [], "what failed fails again"


def test_phases_of_a_known_motion_are_proven_again_if_they_changed(driven, driven_at):
    plan, motions = driven
    store = Store()
    verify_motions(plan, motions, store=store)
    driven_at.clear()
    first, second, *rest = motions[2].phases
    moved = (
        dataclasses.replace(first, end_ns=first.end_ns + 1),
        dataclasses.replace(second, start_ns=first.end_ns + 1),
    )
    other = (*motions[:2], dataclasses.replace(motions[2], phases=(*moved, *rest)), motions[3])
    found = verify_motions(plan, other, store=store)
    assert driven_at == [3, 4]
    assert not found.verified


def test_motions_of_one_site_are_not_proven_of_another(driven, driven_at):
    plan, motions = driven
    store = Store()
    verify_motions(plan, motions, store=store)
    driven_at.clear()
    verify_motions(dataclasses.replace(plan, site=dataclasses.replace(plan.site)), motions, store=store)
    assert driven_at == [1, 2, 3, 4]


def test_with_the_store_off_everything_is_proven_again_with_the_same_result(driven, driven_at, looked_at, monkeypatch):
    plan, motions = driven
    monkeypatch.setenv("BIMVOX_STORE", "off")
    store = Store()
    first = verify_plan(plan, store=store), verify_motions(plan, motions, store=store)
    assert first == (verify_plan(plan, store=store), verify_motions(plan, motions, store=store))
    assert looked_at == 2 * names_of(plan)
    assert driven_at == 2 * [1, 2, 3, 4]
