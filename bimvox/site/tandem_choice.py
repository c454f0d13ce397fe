"""Which parts two cranes of a site carry together: those that the site file names, and those too heavy for one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bimvox.site.assign import named_cranes, reached_from
from bimvox.site.collision import HOOK_FORBIDDEN, hook_room
from bimvox.site.component import Component, Lifting, StoredPose, Tandem
from bimvox.site.config.site_config import ComponentConfig, SiteConfig
from bimvox.site.means import Means
from bimvox.site.site import Site
from bimvox.site.tandem import HELD, Pair, jibs_apart, pairs_for, tandem_rules


def with_tandems(config: SiteConfig, site: Site) -> Site:
    """Return a site with the two cranes of each part that they carry together; the site itself if there is none.

    Raises:
        ConfigError: If the site file asks for a part that no two cranes can carry together.
    """
    chosen = tandems_of(config, site)
    if not chosen:
        return site
    return replace(site, components=tuple(_held(one, chosen.get(one.index)) for one in site.components))


def tandems_of(config: SiteConfig, site: Site) -> dict[int, tuple[int, Tandem]]:
    """Return the first crane, and how two cranes hold it, of each part that they carry together.

    What the site says of its tandem lifts is not looked at.

    Raises:
        ConfigError: As ``with_tandems``.
    """
    entries = {entry.global_id: (n, entry) for n, entry in enumerate(config.component) if entry.tandem is not None}
    automatic = config.rules.tandem is not None and site.has_several_cranes
    if not (automatic or any(entry.tandem for _, entry in entries.values())):
        return {}
    alone = replace(site, components=tuple(replace(one, tandem=None) for one in site.components))
    can = np.ones(len(site.components), np.bool_)
    if automatic:
        can = np.asarray(reached_from(alone)[0].any(axis=1), np.bool_)
    named, found = named_cranes(config, alone.components, site.cranes), dict[int, tuple[int, Tandem]]()
    for part in alone.components:
        number, entry = entries.get(part.id, entries.get(part.global_id, (-1, None)))
        asked = entry is not None and bool(entry.tandem)
        if entry is not None and not asked:
            continue
        if asked and (why := _why_not(alone, part, entry)):
            raise config.error(f"component[{number}].tandem", f"two cranes cannot carry {part.label} together: {why}")
        if not asked and (can[part.index] or part.index in named or _why_not(alone, part, None)):
            continue
        pairs = pairs_for(alone, part)
        if not asked:
            pairs = [one for one in pairs if max(one.used) <= tandem_rules(site.rules).most_share]
        if asked and not pairs:
            raise config.error(
                f"component[{number}].tandem",
                f"no two cranes of the site reach {part.label} at its place",
                hint="move a crane, or remove the key",
            )
        if pairs:
            pair = next((one for one in pairs if _has_room(alone, part, one)), pairs[0])
            found[part.index] = pair.cranes[0], pair.tandem
    return found


def _why_not(site: Site, part: Component, entry: ComponentConfig | None) -> str:
    """Return why two cranes cannot carry a part together, whatever it weighs; empty if they can."""
    if not site.has_several_cranes:
        return "the site has no two cranes that stand there at the same time"
    if part.means is not Means.CRANE:
        return "no crane lifts it"
    if site.access is not None:
        return "its crane unloads every part ([areas] access), and two cranes together unload none"
    if part.erected or part.stored_pose not in (None, StoredPose.AS_BUILT) or part.stored_turn:
        return "it must come as it is set, neither lying nor turned"
    if entry is not None and entry.crane is not None:
        return "the site file names one crane for it"
    return ""


def _has_room(site: Site, part: Component, pair: Pair) -> bool:
    """Return whether both cranes hold a part above some column of the yard, and their jibs keep apart at its place."""
    held = _held(part, (pair.cranes[0], pair.tandem))
    flat = np.zeros(site.shape[:2], np.int32)
    room = hook_room(site, site.cranes[held.crane], flat, held)
    x, y, _ = np.add(part.target_vox, part.hook_offset_vox).tolist()
    return bool(jibs_apart(site, held)[x, y] and (site.yard & (room.floor < HOOK_FORBIDDEN)).any())


def _held(part: Component, held: tuple[int, Tandem] | None) -> Component:
    if held is None:
        return part
    return replace(part, crane=held[0], tandem=held[1], lifting=Lifting(held[1].points_m, HELD))
