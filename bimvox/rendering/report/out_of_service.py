"""Out of service: how a crane is left, the circle that it needs, what stands in it, and from which wind on.

A tower crane is left free to slew with the wind (CPA alert, theconstructionindex.co.uk, "Tower crane guidance for
mothballed sites"; HSE alert, cranestodaymagazine.com), so that its jib needs its whole circle.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from bimvox.crane.outline import CraneOutline, outline_of
from bimvox.rendering.page.source import Revision
from bimvox.rendering.report.html import number
from bimvox.rendering.words import escape
from bimvox.site.site import Site

_NAMED = 5


def out_of_service(revision: Revision) -> list[dict[str, Any]]:
    """Return what each crane needs out of service.

    Returns:
        ``crane, kind, wind_m_s`` (gust from which it does not work), ``radius_m`` of the circle of jib and counter-jib,
        ``low_m`` (their lowest point), and ``meets``: names of parts, obstructions, structure and other cranes that
        reach into the circle at that height. A mobile crane is not left standing: its circle is None.
    """
    site, found = revision.plan.site, []
    for index, crane in enumerate(site.cranes):
        own = outline_of(crane)
        swings = crane.kind != "mobile"
        low_m = min(own.jib_m[0], own.tail_height_m[0])
        radius_m = max(own.jib_end_m, own.tail_m)
        found.append(
            {
                "crane": crane.name,
                "kind": crane.kind,
                "wind_m_s": crane.max_wind_m_s,
                "radius_m": radius_m if swings else None,
                "low_m": low_m if swings else None,
                "meets": list(_meets(site, index, own, radius_m, low_m)) if swings else [],
            }
        )
    return found


def _meets(site: Site, index: int, own: CraneOutline, radius_m: float, low_m: float) -> Iterator[str]:
    """Yield the names of what reaches into the circle of a crane above a height."""
    axis = np.array(own.base_m)
    for component in site.components:
        (low, high) = component.mesh.bounds_m
        if high[2] > low_m and np.linalg.norm(axis - np.clip(axis, low[:2], high[:2])) < radius_m:
            yield component.label
    size_m, origin = site.frame.voxel_size_m, np.array(site.frame.origin_m)
    for blocker in site.blockers:
        if blocker.kind not in ("obstruction", "structure"):
            continue
        tops = (blocker.cells[:, 2] + 1) * size_m + origin[2]
        corners = blocker.cells[tops > low_m, :2] * size_m + origin[:2]
        if (np.linalg.norm(axis - np.clip(axis, corners, corners + size_m), axis=1) < radius_m).any():
            yield blocker.id
    for n, crane in enumerate(site.cranes):
        other = outline_of(crane)
        apart_m = float(np.hypot(*(axis - np.array(other.base_m))))
        mast = apart_m - other.mast_half_m < radius_m and other.mast_height_m[1] > low_m
        below = min(other.jib_m[0], other.tail_height_m[0]) < max(own.jib_m[1], own.tail_height_m[1])
        level = below and max(other.jib_m[1], other.tail_height_m[1]) > low_m
        jibs = crane.kind != "mobile" and level and apart_m < radius_m + max(other.jib_end_m, other.tail_m)
        if n != index and (mast or jibs):
            yield crane.name


def in_words(cranes: Sequence[dict[str, Any]]) -> str:
    """Return how the cranes are left, as escaped HTML."""
    several = len(cranes) > 1
    return "; ".join((f"{escape(one['crane'])}: " if several else "") + _one(one) for one in cranes)


def _one(one: dict[str, Any]) -> str:
    wind = number(one["wind_m_s"], f"{one['wind_m_s']:g} m/s", "out_of_service_wind_m_s")
    begins = f"from a gust of {wind} on; the wind that it withstands: from the manufacturer"
    if one["radius_m"] is None:
        return f"{begins}. The boom is lowered or stowed as the manufacturer says"
    park = "the jib at the manufacturer's radius" if one["kind"] == "luffing" else "trolley where the manufacturer says"
    circle = number(one["radius_m"], f"{one['radius_m']:.1f} m", "out_of_service_radius_m")
    low = number(one["low_m"], f"{one['low_m']:.1f} m", "out_of_service_low_m")
    words = f"{begins}. No load, hook up, {park}, free to slew: the circle of {circle} must be free above z {low}"
    if not one["meets"]:
        return f"{words}; no part, obstruction, structure or other crane of this plan reaches into it"
    names = ", ".join(escape(name) for name in one["meets"][:_NAMED])
    more = f" and {len(one['meets']) - _NAMED} more" if len(one["meets"]) > _NAMED else ""
    meets = "check at that radius" if one["kind"] == "luffing" else "not free to slew"
    return f"{words}. <b>✕ {meets}: {names}{more}</b>"
