"""A lift that is proven is proven again only if it, or anything around it, changed."""

import dataclasses

import pytest
from planned_sites import planned, portal_crane, portal_site

from bimvox.proof import plan as proof
from bimvox.proof.plan import verify_plan
from bimvox.proof.proven import ProvenLifts
from bimvox.records.lift import Status


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
    proven = ProvenLifts()
    first = verify_plan(made, proven=proven)
    assert first.verified
    assert looked_at == names_of(made)
    looked_at.clear()
    assert verify_plan(dataclasses.replace(made), proven=proven) == first == verify_plan(made)
    assert looked_at == names_of(made), "only by the proof that knows nothing"


def test_another_path_is_proven(made, looked_at):
    proven = ProvenLifts()
    verify_plan(made, proven=proven)
    looked_at.clear()
    path_vox = made.lifts[1].path_vox[[0, *range(2, len(made.lifts[1].path_vox))]]
    other = changed(made, 1, path_vox=path_vox)
    found = verify_plan(other, proven=proven)
    assert looked_at == [names_of(made)[1]]
    assert not found.verified
    assert found == verify_plan(other)
    looked_at.clear()
    verify_plan(other, proven=proven)
    assert looked_at == [names_of(made)[1]], "what failed is not remembered"


def test_with_something_else_in_place_all_that_follows_is_proven(made, looked_at):
    proven = ProvenLifts()
    verify_plan(made, proven=proven)
    looked_at.clear()
    other = changed(made, 1, status=Status.INFEASIBLE, path_vox=None, place=None, reason="no path")
    assert verify_plan(other, proven=proven) == verify_plan(other)
    first, _, *later = names_of(made)
    assert looked_at == 2 * [first, *later], "the part does not lie in the yard before the first lift either"


def test_what_is_proven_of_one_site_is_not_of_another(made, looked_at):
    proven = ProvenLifts()
    verify_plan(made, proven=proven)
    looked_at.clear()
    verify_plan(dataclasses.replace(made, site=dataclasses.replace(made.site)), proven=proven)
    assert looked_at == names_of(made)
