"""What a lift keeps less of than the rules ask for by default is a remark and a condition."""

from __future__ import annotations

import dataclasses

import pytest
from planned_sites import planned, portal_crane, portal_site

from bimvox.planning.stage import refused_by_crane
from bimvox.proof.plan import verify_plan
from bimvox.records.lift import LiftPlan, Status
from bimvox.records.motion import LiftMotion
from bimvox.records.proof import Severity
from bimvox.remarks.conditions import conditions_of
from bimvox.remarks.remarks import remarks_of
from bimvox.remarks.table import LOW_WIND, SMALL_CLEARANCE
from bimvox.site.lifting import governing_wind
from bimvox.site.parts import sail_area_m2
from bimvox.site.site import Rules

Planned = tuple[LiftPlan, tuple[LiftMotion, ...]]
BY_DEFAULT = Rules(wind_speed_m_s=12.0, gives_way=("wind_speed_m_s",))


@pytest.fixture(scope="module")
def windy() -> Planned:
    """A beam of 40 m2 of sail, planned for more wind than it permits, by default."""
    bare = portal_site(portal_crane())
    sails = {part.id: {"sail_area_m2": sail_area_m2(part.mesh, tipped=part.erected)} for part in bare.components}
    return planned(portal_site(portal_crane(), parts=sails | {"beam": {"sail_area_m2": 40.0}}, rules=BY_DEFAULT))


def test_a_part_that_permits_less_wind_than_the_default_waits_for_less(windy: Planned) -> None:
    plan, motions = windy
    assert {lift.status for lift in plan.lifts} == {Status.PLANNED}
    assert verify_plan(plan).verified
    (remark,) = (one for one in remarks_of(plan, motions) if one.kind == LOW_WIND.code)
    assert remark.component == "beam"
    governs = governing_wind(plan.site, plan.site.components)
    assert governs is not None
    assert governs.component == "beam"
    assert f"in wind up to {governs.speed_m_s:.1f} m/s only" in remark.text
    assert any("wait for less wind than 12 m/s" in said and "beam" in said for said in conditions_of(plan, motions))


def test_a_wind_in_the_site_file_refuses_it(windy: Planned) -> None:
    site = windy[0].site
    demanded = dataclasses.replace(site, rules=dataclasses.replace(site.rules, gives_way=()))
    beam = next(part for part in site.components if part.id == "beam")
    assert refused_by_crane(site, beam) is None
    assert "permits a wind speed of" in (refused_by_crane(demanded, beam) or "")


def test_a_smaller_sail_area_than_its_own_is_refused_also_by_default(windy: Planned) -> None:
    plan = windy[0]
    parts = tuple(dataclasses.replace(part, sail_area_m2=0.1) for part in plan.site.components)
    proof = verify_plan(dataclasses.replace(plan, site=dataclasses.replace(plan.site, components=parts)))
    assert "wind" in {check.name for check in proof.checks if not check.passed}


def test_a_lift_with_less_clearance_is_named(windy: Planned) -> None:
    plan, motions = windy
    rules = dataclasses.replace(plan.site.rules, transit_clearance_m=2.0, gives_way=("transit_clearance_m",))
    first = dataclasses.replace(plan.lifts[0], clearance_m=0.5)
    plan = dataclasses.replace(plan, site=dataclasses.replace(plan.site, rules=rules), lifts=(first, *plan.lifts[1:]))
    (remark,) = (one for one in remarks_of(plan, motions) if one.kind == SMALL_CLEARANCE.code)
    assert remark.component == plan.site.components[first.component].id
    assert remark.text.startswith("in transit its load keeps 0.5 m, not 2 m: the planner found no way with more")
    assert remark.severity is Severity.SERIOUS
    assert any("keep less than the clearances" in said for said in conditions_of(plan, motions))
