"""The clocks of two cranes that carry a part together, and of a third one."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from tandem_sites import BEAM, crane_at, planned_together, tandem_site

from bimvox.cranes import lifts
from bimvox.cranes.lift import NoFreeTimeError, carrying_track
from bimvox.cranes.schedule import time_lifts
from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.proof.motion import verify_motions
from bimvox.proof.plan import verify_plan
from bimvox.records.motion import by_each_crane
from bimvox.site.tandem import jibs_apart, seen_by

SMALL = ("small", (3.0, 18.0, 0.0), (5.0, 19.0, 1.0))
BEHIND = ("behind", (18.0, 18.0, 0.0), (20.0, 19.0, 1.0))
ON_TOP = ("top", (7.0, 18.0, 1.0), (9.0, 19.0, 2.0))


@pytest.fixture(scope="module")
def made():
    site = tandem_site(parts=(SMALL, BEAM, BEHIND, ON_TOP))
    parts = tuple(replace(one, crane=1) if one.id == "behind" else one for one in site.components)
    return planned_together(replace(site, components=parts))


def test_it_is_proven_between_other_lifts_of_both_cranes(made):
    plan, motions = made
    assert (verify_plan(plan).failures, verify_motions(plan, motions).failures) == ((), ())
    assert [one.second is not None for one in motions] == [lift.tandem is not None for lift in plan.lifts]
    assert {one.crane for one in motions} == {0, 1}


def test_each_crane_has_one_clock(made):
    plan, motions = made
    for number in range(len(plan.site.cranes)):
        own = sorted((one for one in by_each_crane(motions) if one.crane == number), key=lambda one: one.start_ns)
        assert own[0].start_ns == 0
        assert all(one.end_ns == other.start_ns for one, other in pairwise(own))


def test_a_third_crane_lifts_nothing_meanwhile():
    site = tandem_site(parts=(BEAM, ("far", (40.0, 18.0, 0.0), (42.0, 19.0, 1.0))), shape=(110, 48, 44))
    third = crane_at("third", 44.0, height=42.0)
    yard = site.yard.copy()
    yard[78:104, 18:30] = True
    parts = (site.components[0], replace(site.components[1], crane=2, start_vox=(84, 20, 1)))
    plan, motions = planned_together(replace(site, cranes=(*site.cranes, third), components=parts, yard=yard))
    beam = next(one for one in motions if one.second is not None)
    (other,) = (one for one in motions if one is not beam)
    assert other.crane == 2
    assert other.hooked_ns >= beam.released_ns or other.released_ns <= beam.hooked_ns
    assert verify_motions(plan, motions).verified


def test_a_rope_that_the_other_jib_would_meet():
    """The jib of the lower crane reaches beyond its hook, to the rope of the higher one behind it."""
    site = tandem_site()
    inline = (replace(site.cranes[0], base_m=(1.0, 17.0, 0.0)), replace(site.cranes[1], base_m=(24.0, 17.0, 0.0)))
    site = replace(site, cranes=inline)
    (lift,) = plan_lifts(site, prepare(site)).lifts
    assert lift.reason == (
        "two cranes hold it, and above its place jib and rope of west and east would come too near to each other "
        "([rules] crane_separation_m is 2 m, and they must brake)"
    )


def test_cranes_that_come_too_near_on_the_way(monkeypatch):
    """With its load on each hook, the one would meet the other: it stands for anything that comes too near."""
    site = tandem_site()
    preparation = prepare(site)
    plan = plan_lifts(site, preparation)

    def with_load(site, crane, _, motion):
        return carrying_track(seen_by(site, motion.crane), crane, plan.lifts[0], motion)

    monkeypatch.setattr(lifts, "bare_track", with_load)
    with pytest.raises(NoFreeTimeError, match="west and east cannot carry it together: the load of west"):
        time_lifts(plan, preparation)


def test_the_yard_place_is_one_where_their_jibs_keep_apart():
    """Above the nearest place in the yard one jib would reach the other rope; it lies where none does."""
    site = tandem_site()
    (lift,) = plan_lifts(site, prepare(site)).lifts
    hooks = lift.path_vox[:, :2] + np.array(site.components[0].hook_offset_vox[:2])
    assert jibs_apart(site, site.components[0])[tuple(hooks.T)].all()
    assert not jibs_apart(site, site.components[0]).all()


def test_a_site_without_such_parts_is_seen_as_it_is():
    site = tandem_site(parts=(SMALL,))
    assert seen_by(site, 0).components == site.components
