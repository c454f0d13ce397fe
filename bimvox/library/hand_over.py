"""Parts that another crane lifts than its own, each with a note in the plan; a faster sequence for several cranes.

A lift without a free time for its crane goes to another crane that serves it. Its part stays at its place in the yard,
and the sequence stays as it is. The other crane must have the same slings, carry the part at its pick and at its place,
and have time for it: the schedule says that. Other parts are reassigned by the search for a faster sequence.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from bimvox.crane.tower_crane import TowerCrane
from bimvox.cranes.lift import NoFreeTimeError
from bimvox.cranes.schedule import time_lifts
from bimvox.errors import MotionError
from bimvox.planning.order_search import faster, plan_without_obstructions, prepare, prepare_set_ups
from bimvox.planning.planner import plan_lifts
from bimvox.planning.preparation import Preparation
from bimvox.planning.stage import could_lift
from bimvox.progress import Report
from bimvox.records.lift import LiftPlan
from bimvox.site.build import with_digests
from bimvox.site.component import Component
from bimvox.site.site import Site
from bimvox.walk import Store
from bimvox.workers import ALONE, Workers

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


def _given_to_others(site: Site, other: Site, preparation: Preparation) -> tuple[Site, Preparation]:
    """Return a site and its preparation, with a note on each part that another crane lifts than on the site before."""
    pairs = [(a, b) for a, b in zip(site.components, other.components, strict=True) if a.crane != b.crane]
    if not pairs:
        return site, preparation
    notes = [_faster_note(a, site.cranes[a.crane], site.cranes[b.crane]) for a, b in pairs]
    return _with_cranes(site, {b.index: b.crane for _, b in pairs}), _noted(preparation, notes)


def as_ordered(site: Site, other: Site, preparation: Preparation) -> tuple[Site, Preparation]:
    """Return a site with the cranes that an order of the caller names, and its preparation with a note on each."""
    pairs = [(a, b) for a, b in zip(site.components, other.components, strict=True) if a.crane != b.crane]
    if not pairs:
        return site, preparation
    notes = [_ordered_note(a, site.cranes[a.crane], site.cranes[b.crane]) for a, b in pairs]
    return _with_cranes(site, {b.index: b.crane for _, b in pairs}), _noted(preparation, notes)


def may_go_to_others(loaded: LoadedSite) -> list[str]:
    """Return the ids of the components that another crane may lift: those whose crane the site file does not name."""
    return without_named_crane(loaded.site, loaded.config)


def without_named_crane(site: Site, config: SiteConfig) -> list[str]:
    """Return the ids of a site's components whose crane a site file does not name."""
    key = "setup" if config.moves else "crane"
    named = {entry.global_id for entry in config.component if getattr(entry, key) is not None}
    alone = (part for part in site.components if part.tandem is None)
    return [part.id for part in alone if named.isdisjoint((part.id, part.global_id))]


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
        while left:  # after it was reassigned, a part may have been handed over once more
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


def _notes(part: Component, own: TowerCrane, crane: TowerCrane) -> tuple[str, ...]:
    return _no_time_note(part, own, crane), _faster_note(part, own, crane), _ordered_note(part, own, crane)


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


def _ordered_note(part: Component, own: TowerCrane, crane: TowerCrane) -> str:
    return f"{part.label}: {crane.name} lifts it instead of {own.name}, as the given order says"


# What is prepared for a site; for several cranes with a faster erection sequence, by their scheduled motions.
#
# The local search estimates. So its sequences, with each part lifted by its crane and with other cranes where that may
# be faster, are planned and scheduled without obstructions, the greedy one included. Kept is the one in which fewest
# lifts have no free time, and of these the fastest.


def preparation_of(
    site: Site,
    progress: Report | None = None,
    workers: Workers = ALONE,
    free: Collection[str] = (),
    store: Store | None = None,
) -> tuple[Site, Preparation]:
    """Return contacts, order and yard places of a site, and the site with the crane that lifts each part.

    Args:
        site: The site.
        progress: Called with (stage, done, total).
        workers: Share the work.
        free: Ids of the components that another crane may lift.
        store: What was planned and timed before is not done again.
    """
    store = Store() if store is None else store
    if site.moving is not None:
        return prepare_set_ups(site, free, _with_cranes, progress, workers, store)
    preparation = prepare(site, progress, workers, store)
    if not site.has_several_cranes:
        return site, preparation
    return faster_on_the_clock(site, preparation, workers, free, store)


def faster_on_the_clock(
    site: Site,
    greedy: Preparation,
    workers: Workers = ALONE,
    free: Collection[str] = (),
    store: Store | None = None,
) -> tuple[Site, Preparation]:
    """Return the preparation of a site with several cranes with the fastest sequence that is found, and the site then.

    Args:
        site: The site.
        greedy: Its preparation with the greedy sequence.
        workers: Share the work.
        free: Ids of the components that another crane may lift.
        store: As for ``preparation_of``.
    """
    store = Store() if store is None else store
    ways = [(site, greedy)]
    for ids in ((), free):
        found = faster(site, greedy, workers, ids, store) if ids is free or free else None
        if found is not None and all(_differs(found, way) for way in ways):
            ways.append(found)
    if len(ways) == 1:
        return ways[0]
    ends = [waiting_and_end(*way, workers, free, store) for way in ways]
    known = [n for n, end in enumerate(ends) if end is not None]
    other, made = ways[min(known, key=lambda n: ends[n] or (0, 0), default=0)]
    return _given_to_others(site, other, made)


def _differs(one: tuple[Site, Preparation], other: tuple[Site, Preparation]) -> bool:
    cranes, others = ([part.crane for part in site.components] for site, _ in (one, other))
    return cranes != others or one[1].sequence.order != other[1].sequence.order


def waiting_and_end(
    site: Site,
    preparation: Preparation,
    workers: Workers = ALONE,
    free: Collection[str] = (),
    store: Store | None = None,
) -> tuple[int, int] | None:
    """Return how many lifts have no free time, and when the last one ends; None if a lift cannot be driven.

    The end is on the site's clock without obstructions.

    Args:
        site: The site, with several cranes.
        preparation: Its preparation.
        workers: Share the work.
        free: Ids of the components that another crane may lift if their own has no free time for them.
        store: As for ``preparation_of``.
    """
    store = Store() if store is None else store
    plan = plan_without_obstructions(site, preparation, workers, store)
    site, handed, refused = plan.site, set[str](), dict[str, str]()
    while True:
        try:
            motions = time_lifts(plan, preparation, store, workers)
        except NoFreeTimeError as error:
            may = [part for part in error.reasons if part in free and part not in handed]
            handed.update(may)
            site, preparation, reassigned = handed_over(site, preparation, may)
            refused.update({part: why for part, why in error.reasons.items() if part not in reassigned})
            plan = plan_lifts(site, preparation, refused=refused, workers=workers, store=store)
        except MotionError:
            return None
        else:
            return len(refused), max((motion.end_ns for motion in motions), default=0)
