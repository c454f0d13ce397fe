"""Parts that another crane lifts than the one that they are assigned to, each with a note in the plan.

A lift without a free time for its crane goes to another crane that serves it. Its part stays at its place in the yard,
and the sequence stays as it is. The other crane must have the same slings, carry the part at its pick and at its place,
and have time for it: the schedule says that. Other parts are given away by the search for a faster sequence.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from bimvox.crane.tower_crane import TowerCrane
from bimvox.planning.preparation import Preparation
from bimvox.planning.stage import could_lift
from bimvox.records.lift import LiftPlan
from bimvox.site.build import with_digests
from bimvox.site.component import Component
from bimvox.site.site import Site

if TYPE_CHECKING:
    from bimvox.library.site import LoadedSite
    from bimvox.site.config.site_config import SiteConfig


def handed_over(site: Site, preparation: Preparation, ids: Collection[str]) -> tuple[Site, Preparation, list[str]]:
    """Return the site in which other cranes lift parts, its preparation, and the ids of those parts.

    ``ids``: ids of the parts for which their own crane has no free time; no other crane may serve some of them.
    """
    cranes, notes = {}, []
    for part in (one for one in site.components if one.id in ids):
        place, own = preparation.places[part.index], site.cranes[part.crane]
        for number, crane in enumerate(site.cranes):
            if number != part.crane and place is not None and could_lift(site, part, place, number):
                cranes[part.index] = number
                notes.append(_no_time_note(part, own, crane))
                break
    if not cranes:
        return site, preparation, []
    return _with_cranes(site, cranes), _noted(preparation, notes), [site.components[i].id for i in cranes]


def given_to_others(site: Site, other: Site, preparation: Preparation) -> tuple[Site, Preparation]:
    """Return a site and its preparation, with a note on each part that another crane lifts than on the site before."""
    pairs = [(a, b) for a, b in zip(site.components, other.components, strict=True) if a.crane != b.crane]
    if not pairs:
        return site, preparation
    notes = [_faster_note(a, site.cranes[a.crane], site.cranes[b.crane]) for a, b in pairs]
    return _with_cranes(site, {b.index: b.crane for _, b in pairs}), _noted(preparation, notes)


def may_go_to_others(loaded: LoadedSite) -> list[str]:
    """Return the ids of the components that another crane may lift: those whose crane the site file does not name."""
    return without_named_crane(loaded.site, loaded.config)


def without_named_crane(site: Site, config: SiteConfig) -> list[str]:
    """Return the ids of a site's components whose crane a site file does not name."""
    named = {entry.global_id for entry in config.component if entry.crane is not None}
    return [part.id for part in site.components if named.isdisjoint((part.id, part.global_id))]


def with_cranes_of(site: Site, other: Site) -> Site:
    """Return a site in which each part is lifted by the crane that lifts it on another site with the same parts."""
    return _with_cranes(site, {part.index: part.crane for part in other.components})


def is_of(plan: LiftPlan, site: Site) -> bool:
    """Return whether a plan is of a site but for obstructions, and for parts that went to other cranes by its notes."""
    cranes, own = ([part.crane for part in one.components] for one in (as_assigned(plan), site))
    return cranes == own and with_cranes_of(site, plan.site).fixed_digest == plan.site.fixed_digest


def as_assigned(plan: LiftPlan) -> Site:
    """Return the site of a plan with every part that was handed over, by the plan's notes, back at its first crane."""
    site = plan.site
    if not site.has_several_cranes:
        return site
    first: dict[int, int] = {}
    for part in site.components:
        left, crane = set(plan.notes), site.cranes[part.crane]
        while left:  # given away, a part may have been handed over once more
            before = ((own, note) for own in site.cranes for note in _notes(part, own, crane) if note in left)
            own, note = next(before, (crane, ""))
            if not note:
                break
            left.remove(note)
            crane, first[part.index] = own, site.cranes.index(own)
    return _with_cranes(site, first) if first else site


def _with_cranes(site: Site, cranes: Mapping[int, int]) -> Site:
    parts = tuple(replace(part, crane=cranes.get(part.index, part.crane)) for part in site.components)
    return with_digests(replace(site, components=parts))


def _noted(preparation: Preparation, notes: Sequence[str]) -> Preparation:
    sequence = replace(preparation.sequence, notes=(*preparation.sequence.notes, *notes))
    return replace(preparation, sequence=sequence)


def _notes(part: Component, own: TowerCrane, crane: TowerCrane) -> tuple[str, str]:
    return _no_time_note(part, own, crane), _faster_note(part, own, crane)


def _no_time_note(part: Component, own: TowerCrane, crane: TowerCrane) -> str:
    return (
        f"{part.label}: {own.name} has no free time for it alongside the other cranes, so {crane.name} lifts it; "
        f'[[component]] crane = "{crane.name}" keeps that'
    )


def _faster_note(part: Component, own: TowerCrane, crane: TowerCrane) -> str:
    return (
        f"{part.label}: {crane.name} lifts it instead of {own.name}, all in all that is faster; "
        f'[[component]] crane = "{own.name}" prevents that'
    )
