"""Compares the parts of a site with what its site file asks of them: ``[[component]]``, ``[sequence]`` and zones."""

from __future__ import annotations

from dataclasses import replace

from bimvox.bim.building import Building
from bimvox.bim.kinds.correction import OUT, SITE_FILE_SAYS
from bimvox.library.compare import same, same_fields
from bimvox.records.proof import Check
from bimvox.site.assign import assigned
from bimvox.site.build import left_out
from bimvox.site.component import Component, OrderHints
from bimvox.site.config.site_config import SiteConfig
from bimvox.site.ground import are_over_others
from bimvox.site.means import Means
from bimvox.site.one_piece import means_by
from bimvox.site.order_hints import order_hints
from bimvox.site.parts import entries_by_id, first_ids, stored_as
from bimvox.site.rigging import gear_by_crane
from bimvox.site.site import Site

_OF_THE_FILE = ("first", "zone", "zone_name")
"""Hints about the order that follow from the site file; the others are from the building file."""


def compare_pinned(check: Check, site: Site, config: SiteConfig, source: str) -> SiteConfig:
    """Check that what the site file pins is there and is not lifted, and that what it leaves out is not there.

    Args:
        check: Receives what was compared.
        site: The site.
        config: The site file.
        source: What to call the file.

    Returns:
        The site file without the tables of parts that are left out, and of pinned parts that are not in the log: they
        are outside the site, or the check has failed.
    """
    fixed = {blocker.id for blocker in site.blockers if blocker.kind == "structure"}
    known = fixed | {name.rpartition("#")[0] for name in fixed}
    kept = []
    for entry in config.component:
        name = entry.global_id
        if entry.pinned:
            lifted = next((c.label for c in site.components if name in (c.id, c.global_id)), None)
            check.look(lifted is None, f"{lifted}: it is lifted, but {source} pins it: it exists already")
            outside = left_out(name) in site.notes
            there = name in known or lifted is not None or outside
            check.look(there, f"{name}: {source} pins it, but it is not a fixed object of the log")
        elif entry.means == OUT:
            inside = next((c.label for c in site.components if name in (c.id, c.global_id)), None)
            check.look(inside is None, f"{inside}: it is a part of the plan, but {source} leaves it out")
        if (not entry.pinned or name in known) and entry.means != OUT:
            kept.append(entry)
    return config.model_copy(update={"component": tuple(kept)})


def compare_parts(check: Check, site: Site, config: SiteConfig, building: Building, source: str) -> None:
    """Check how parts are stored, in which order the site file wants them, and which crane lifts each.

    Args:
        check: Receives what was compared.
        site: The site.
        config: The site file, complete.
        building: The building of the site, see ``bimvox.library.completed_site_file``.
        source: What to call the file.

    Raises:
        ConfigError: If the file names a part or a crane that the site does not have.
    """
    elements = building.elements[: len(site.components)]
    entries = entries_by_id(config, building.elements)
    hints = order_hints(config, elements, first_ids(config, elements), ())
    means = means_by(config, elements, entries)
    said = config.corrections
    kinds, ways = {one.kind for one in said}, {one.means for one in said}
    for part, element in zip(site.components, elements, strict=True):
        check.about = part.id
        of_file = part.judgement.why != SITE_FILE_SAYS or part.judgement.kind in kinds
        check.look(of_file, f"{part.label}: {source} says of no part that its kind is {part.judgement.kind.value}")
        of_file = part.stated_means is None or part.stated_means in ways
        check.look(of_file, f"{part.label}: {source} says of no type of part that its means are {part.stated_means}")
        same(check, f"{part.label}: means", part.means, means[part.id].means, source)
        same(check, f"{part.label}: means_reason", part.means_reason, means[part.id].why, source)
        wanted = stored_as(element, entries.get(part.id), site.frame)
        same_fields(check, f"{part.label}: ", part, wanted, source)
        _compare_hints(check, part, hints[part.id], config, source)
        same(check, f"{part.label}: hints.rank", part.hints.rank, hints[part.id].rank, source)
    over = are_over_others(site.frame, site.shape[:2], site.natural_ground_m, site.components)
    for part, spans in zip(site.components, over, strict=True):
        same(check, f"{part.label}: spans", part.spans, spans, "its parts")
    parts = [replace(part, crane=0) for part in site.components]
    lifted_by = assigned(config, parts, site.cranes, site.yard, site.frame, site.rules)
    for part, other in zip(site.components, lifted_by, strict=True):
        check.about = part.id
        same(check, f"{part.label}: crane", part.crane, other.crane, f"what follows from {source}")
    gear = gear_by_crane(config, len(site.cranes))
    for part in site.components if any(gear) else ():
        check.about = part.id
        has_gear = part.lifting.rig is not None or bool(part.lifting.no_gear)
        good = has_gear or part.means is not Means.CRANE or gear[part.crane] is None
        check.look(good, f"{part.label}: {source} has gear chosen for it, but it has none")
    check.about = None


def _compare_hints(check: Check, part: Component, wanted: OrderHints, config: SiteConfig, source: str) -> None:
    for key in _OF_THE_FILE:
        same(check, f"{part.label}: hints.{key}", getattr(part.hints, key), getattr(wanted, key), source)
    if not config.sequence.storeys:
        same(check, f"{part.label}: hints.storey_rank", part.hints.storey_rank, None, source)
    if config.sequence.schedule and config.programme is not None:
        for key in ("task", "task_rank"):
            same(check, f"{part.label}: hints.{key}", getattr(part.hints, key), getattr(wanted, key), source)
    if not config.sequence.schedule:
        same(check, f"{part.label}: hints.task", part.hints.task, None, source)
