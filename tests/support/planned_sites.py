"""Planned and timed lifts of a small portal under a crane, for tests of rules for whole plans."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from box_sites import box_site, test_crane

from bimvox.crane.tower_crane import TowerCrane
from bimvox.motion.time_plan import time_plan
from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.proof.motion import verify_motions
from bimvox.proof.plan import verify_plan
from bimvox.records.lift import LiftPlan, Status
from bimvox.records.motion import LiftMotion
from bimvox.site.site import Site

PORTAL = [
    ("slab", (1.0, 1.0, 3.5), (5.0, 2.0, 4.0)),
    ("beam", (1.0, 1.0, 3.0), (5.0, 1.5, 3.5)),
    ("left", (1.0, 1.0, 0.0), (1.5, 1.5, 3.0), {"ifc_class": "IfcColumn", "erected": True}),
    ("right", (4.5, 1.0, 0.0), (5.0, 1.5, 3.0), {"ifc_class": "IfcColumn", "erected": True}),
]


def portal_crane(**more: Any) -> TowerCrane:
    return dataclasses.replace(test_crane(base=(10.0, -3.0, 0.0), jib=40.0, height=11.0), **more)


def portal_site(crane: TowerCrane, *, parts: dict[str, dict[str, Any]] | None = None, **more: Any) -> Site:
    """Return the site; ``parts``: fields of components by name; ``more``: fields of the site."""
    site = box_site(PORTAL, crane=crane)
    components = tuple(dataclasses.replace(c, **(parts or {}).get(c.id, {})) for c in site.components)
    return dataclasses.replace(site, components=components, **more)


def planned(site: Site) -> tuple[LiftPlan, tuple[LiftMotion, ...]]:
    preparation = prepare(site)
    plan = plan_lifts(site, preparation)
    return plan, time_plan(plan, preparation)


def failures(plan: LiftPlan, motions: tuple[LiftMotion, ...], **site: Any) -> set[str]:
    """Return the names of the checks that fail after fields of the site are replaced."""
    other = dataclasses.replace(plan, site=dataclasses.replace(plan.site, **site))
    checks = (*verify_plan(other).checks, *verify_motions(other, motions).checks)
    return {check.name for check in checks if not check.passed}


def all_planned(plan: LiftPlan) -> bool:
    return all(lift.status is Status.PLANNED for lift in plan.lifts)


def rectangle(site: Site, x0: float, y0: float, x1: float, y1: float) -> np.ndarray:
    """Return the columns of a rectangle in metres."""
    mask = np.zeros(site.shape[:2], np.bool_)
    h = site.frame.voxel_size_m
    mask[int(x0 / h) : int(x1 / h), int(y0 / h) : int(y1 / h)] = True
    return mask
