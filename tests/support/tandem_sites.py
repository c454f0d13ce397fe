"""Small sites with a beam that two cranes carry together."""

from __future__ import annotations

from dataclasses import replace

from box_sites import box_site, test_crane

from bimvox.crane.load_chart import LoadChart
from bimvox.crane.tower_crane import TowerCrane
from bimvox.cranes.schedule import time_lifts
from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.records.lift import LiftPlan
from bimvox.records.motion import LiftMotion
from bimvox.site.component import Lifting
from bimvox.site.default_rules import TandemRules
from bimvox.site.site import Rules, Site
from bimvox.site.tandem import HELD, pairs_for

BEAM = ("beam", (6.0, 18.0, 0.0), (16.0, 19.0, 1.0))
"""24 t, 10 m long: more than each crane carries."""
_RULES = TandemRules()


def crane_at(name: str, x: float, y: float = 3.0, *, most_kg: float = 20_000.0, height: float = 30.0) -> TowerCrane:
    """Return a tower crane of 20 m."""
    one = replace(test_crane(base=(x, y, 0.0), height=height), name=name, hook_block_kg=200.0, rigging_mass_kg=300.0)
    return replace(one, chart=LoadChart((2.0, 20.0), (most_kg, most_kg)), jib_length_m=20.0)


def tandem_site(
    *,
    parts: tuple[tuple, ...] = (BEAM,),
    shape: tuple[int, int, int] = (52, 48, 40),
    rules: TandemRules = _RULES,
    west: TowerCrane | None = None,
    **more: object,
) -> Site:
    """Return a site with two cranes; what is heavier than 20 t, both carry."""
    cranes = (west or crane_at("west", 7.0), crane_at("east", 15.0, height=36.0))
    site = box_site(
        parts,
        crane=cranes[0],
        yard=((6.0, 18.0), (42.0, 30.0)),
        shape=shape,
        rules=Rules(tandem=rules, **more),
    )
    site = replace(site, cranes=cranes)
    return replace(site, components=tuple(_held(site, one) for one in site.components))


def _held(site: Site, part):
    if part.mass_kg <= 20_000.0:
        return part
    pair = pairs_for(site, part)[0]
    return replace(part, crane=pair.cranes[0], tandem=pair.tandem, lifting=Lifting(pair.tandem.points_m, HELD))


def planned_together(site: Site) -> tuple[LiftPlan, tuple[LiftMotion, ...]]:
    """Return the plan of a site, and its motions."""
    preparation = prepare(site)
    plan = plan_lifts(site, preparation)
    return plan, time_lifts(plan, preparation)
