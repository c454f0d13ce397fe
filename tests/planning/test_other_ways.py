"""A lift that its proof refuses gets other last moves before it is refused."""

import numpy as np
import pytest
from box_sites import box_site, test_crane

from bimvox.errors import NoPlanError
from bimvox.library import prove
from bimvox.planning.assembly import Assembly
from bimvox.planning.order_search import prepare
from bimvox.planning.stage import Stage
from bimvox.policy.choice import NO_POLICY
from bimvox.progress import SilentProgress
from bimvox.proof.plan import verify_plan
from bimvox.records.lift import Status
from bimvox.records.proof import Check, Verification

FLOOR = ("floor", (3.0, 3.0, 0.0), (9.0, 6.0, 0.4))
BLOCK = ("block", (5.0, 4.0, 0.42), (6.0, 5.0, 1.4))


@pytest.fixture
def site():
    return box_site([BLOCK], structure=[FLOOR], crane=test_crane(base=(10.0, -3.0, 0.0)))


def test_other_last_moves_share_no_placement_with_those_to_avoid(site):
    preparation = prepare(site)
    first = Assembly(site, preparation).begin(0)
    other = Assembly(site, preparation).begin(0, avoided=(first.insertion,))
    assert isinstance(first, Stage)
    assert isinstance(other, Stage)
    before, now = ({tuple(cell) for cell in stage.insertion.path_vox.tolist()} for stage in (first, other))
    assert before & now == {site.components[0].target_vox}


def planned(site):
    return prove.plan_and_prove(site, prepare(site), NO_POLICY, progress=SilentProgress())


def refusing(says):
    """Return a proof of plans that also refuses every lift about whose last moves a rule says so."""

    def verify(plan, **known):
        check = Check("triangles")
        for lift in plan.lifts:
            check.about = plan.site.components[lift.component].id
            bad = lift.path_vox is not None and says(lift.last_moves_vox)
            check.look(not bad, f"{check.about}: meets floor deeper than it may")
        return Verification((*verify_plan(plan, **known).checks, check))

    return verify


def test_a_lift_refused_straight_down_is_set_from_the_side(site, monkeypatch):
    straight = planned(site).plan.lifts[0].last_moves_vox
    assert (straight[:, :2] == straight[0, :2]).all()
    monkeypatch.setattr(prove, "verify_plan", refusing(lambda last: (last[:, :2] == last[0, :2]).all()))
    found = planned(site)
    lift = found.plan.lifts[0]
    assert lift.status is Status.PLANNED
    assert (lift.last_moves_vox[:, :2] != lift.last_moves_vox[0, :2]).any()
    assert found.verdict.verified
    assert np.array_equal(lift.path_vox[-1], straight[-1])


def test_a_lift_whose_other_ways_are_refused_too_keeps_the_first_reason(site, monkeypatch):
    beside = ("other", (12.0, 9.0, 0.0), (13.0, 10.0, 1.0))
    site = box_site([BLOCK, beside], structure=[FLOOR], crane=test_crane(base=(10.0, -3.0, 0.0)))
    asked = []

    def says(last):
        bad = last[-1].tolist() == list(site.components[0].target_vox)
        asked.append(bad)
        return bad

    monkeypatch.setattr(prove, "verify_plan", refusing(says))
    lifts = {lift.component: lift for lift in planned(site).plan.lifts}
    assert lifts[0].status is Status.INFEASIBLE
    assert lifts[0].reason.startswith("its lift could not be proven: triangles: block: meets floor")
    assert lifts[1].status is Status.PLANNED
    assert sum(asked) == 3  # the first way and two others


def test_nothing_is_left_when_the_only_lift_is_refused(site, monkeypatch):
    monkeypatch.setattr(prove, "verify_plan", refusing(lambda last: True))
    with pytest.raises(NoPlanError, match="could not be proven"):
        planned(site)
