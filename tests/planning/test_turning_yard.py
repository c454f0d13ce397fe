"""In the yard, parts lie where they have room to turn with the jib, if there is such a place."""

import dataclasses

from box_sites import box_site
from turning_sites import PORTAL, turning_site

from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.site.site import HeadingRule, Site

SILO = ("silo", (20.0, 8.0, 0.0), (22.0, 24.0, 19.0))


def silo_site(heading: HeadingRule) -> Site:
    """Return the portal with a silo between it and its yard, too high for any load to turn above it."""
    own = turning_site(heading, transit_clearance_m=2.0)
    yard = ((44, 8), (80, 50))
    return box_site(PORTAL, crane=own.cranes[0], shape=own.shape, yard=yard, structure=[SILO], rules=own.rules)


def test_loads_lie_where_they_can_turn():
    site = silo_site(HeadingRule.WITH_JIB)
    plan = plan_lifts(site, prepare(site))
    turning = sum(lift.with_jib for lift in plan.lifts)
    kept = silo_site(HeadingRule.KEPT)
    places = prepare(kept).places
    there = dataclasses.replace(prepare(site), places=places)
    assert turning > sum(lift.with_jib for lift in plan_lifts(site, there).lifts)
