"""Sites whose slabs lie in stacks, and what lies where in their yards."""

from __future__ import annotations

from collections.abc import Sequence

from box_sites import box_site, test_crane

from bimvox.records.lift import LiftPlan
from bimvox.site.default_rules import YardRules
from bimvox.site.site import Rules, Site

SLAB = {"ifc_class": "IfcSlab"}


def slab_site(
    sizes: Sequence[tuple[float, float, float]] = ((4.0, 2.0, 0.2),) * 4,
    lying: YardRules | None = YardRules(),  # noqa: B008  # frozen
    *,
    crane: bool = True,
    **more,
) -> Site:
    """Return a site with slabs of these sizes side by side on two rails, and a yard of 20 by 15 m next to it."""
    parts, at = [], 0.5
    for n, (length, width, height) in enumerate(sizes):
        parts.append((f"slab {n}", (0.5, at, 0.0), (0.5 + length, at + width, height), SLAB))
        at += width + 0.5
    own = test_crane(base=(9.0, -4.0, 0.0), jib=40.0, height=14.0) if crane else None
    rules = Rules(rope=crane, yard=lying, **more.pop("rules", {}))
    return box_site(
        parts, crane=own, rules=rules, **{"shape": (64, 50, 24), "yard": ((24.0, 0.0), (64.0, 50.0))} | more
    )


def stacks_of(plan: LiftPlan) -> list[list[str]]:
    """Return the names of the parts of each stack, from the top down."""
    found: dict[tuple[int, int], list[tuple[int, str]]] = {}
    for lift in plan.lifts:
        if lift.place is not None and lift.place.stack:
            name = plan.site.components[lift.component].id
            found.setdefault((lift.place.delivery, lift.place.stack), []).append((lift.place.cell_vox[2], name))
    return [[name for _, name in sorted(members, reverse=True)] for _, members in sorted(found.items())]
