"""A lift without a free time for its crane goes to another crane that serves it.

Its part stays at its place in the yard, and the sequence stays as it is. The other crane must have the same slings,
carry the part at its pick and at its place, and have time for it: the schedule says that.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bimvox.crane.reach import allowed_radii_m
from bimvox.crane.tower_crane import TowerCrane
from bimvox.cranes.lift import NoFreeTimeError
from bimvox.planning.assembly import Preparation
from bimvox.planning.refusal import refused_by_crane
from bimvox.records.lift import LiftPlan
from bimvox.site.build import with_digests
from bimvox.site.component import Component
from bimvox.site.lifting import crane_for
from bimvox.site.site import Site


def handed_over(site: Site, preparation: Preparation, error: NoFreeTimeError) -> tuple[Site, Preparation] | None:
    """Return the site in which another crane lifts a part, and its preparation; None if no other crane serves it.

    Args:
        site: The site.
        preparation: Its preparation.
        error: Names the part; its own crane has no free time for it.
    """
    part = next(one for one in site.components if one.id == error.component)
    own = site.cranes[part.crane]
    for number, crane in enumerate(site.cranes):
        if number == part.crane or crane.sling_m != own.sling_m:
            continue
        given = replace(part, crane=number)
        parts = (*site.components[: part.index], given, *site.components[part.index + 1 :])
        other = with_digests(replace(site, components=parts))
        if refused_by_crane(other, given) is None and _picks(other, preparation, given):
            note = _note(part, own, crane)
            sequence = replace(preparation.sequence, notes=(*preparation.sequence.notes, note))
            return other, replace(preparation, sequence=sequence)
    return None


def as_assigned(plan: LiftPlan) -> Site:
    """Return the site of a plan with every part that was handed over, by the plan's notes, back at its first crane."""
    site = plan.site
    if not site.has_several_cranes:
        return site
    parts = tuple(
        next(
            (replace(part, crane=n) for n, own in enumerate(site.cranes) if _note(part, own, crane) in plan.notes), part
        )
        for part, crane in ((part, site.cranes[part.crane]) for part in site.components)
    )
    return replace(site, components=parts)


def _note(part: Component, own: TowerCrane, crane: TowerCrane) -> str:
    return (
        f"{part.label}: {own.name} has no free time for it alongside the other cranes, so {crane.name} lifts it; "
        f'[[component]] crane = "{crane.name}" keeps that'
    )


def _picks(site: Site, preparation: Preparation, part: Component) -> bool:
    """Return whether a part's crane carries it at its place in the yard."""
    place, crane = preparation.places[part.index], site.cranes[part.crane]
    if place is None:
        return False
    hook_vox = np.add(place.transit_start_vox, part.hook_line_vox)[:2] + 0.5
    at_m = site.frame.corner_of([*hook_vox.tolist(), 0.0])[:2]
    low_m, high_m = allowed_radii_m(crane_for(site, crane, part), part.mass_kg, site.rules.highest_utilisation)
    return bool(low_m <= np.hypot(*(at_m - np.array(crane.base_m[:2]))) <= high_m)
