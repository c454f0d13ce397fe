"""Clear distances of the cranes as they are measured on site, and the room to erect and dismantle them."""

from __future__ import annotations

from typing import Any

import shapely

from bimvox.crane.outline import outline_of, tail_low_m
from bimvox.crane.tower_crane import TowerCrane
from bimvox.remarks.subject import Subject
from bimvox.rendering.page.source import Revision
from bimvox.rendering.report.html import number, paragraph, row, table
from bimvox.rendering.report.words import fixed
from bimvox.rendering.words import escape
from bimvox.site.areas import area_of, rounded
from bimvox.site.crane_distances import (
    STANDING_M,
    TRAPPED_M,
    base_of,
    of_crane,
    to_areas,
    to_cranes,
)
from bimvox.site.crane_room import PLACE_M, Place, place_beside, room_for_jib, way_among, way_in

_KINDS = {
    "building": "building, as finished",
    "structure": "existing structure",
    "obstruction": "obstruction",
    "stored": "parts in the yard",
    "yard": "yard",
    "access": "access of trucks",
    "excavation": "edge of the excavation",
    "boundary": "boundary of the plot",
    "crane": "other crane",
}
_PIECES = ("mast", "base", "tail", "below tail")


def distances_of(revision: Revision) -> list[dict[str, Any]]:
    """Return the clear distances of each crane.

    Returns:
        ``crane, kind, base`` (``edge_m``, ``stated``), ``tail`` (``radius_m, low_m, high_m``), ``least_m`` (between a
        moving part and anything fixed), ``distances`` (``from, to, name, distance_m, ends_m``), ``erection`` and
        ``dismantling``: ``room``, ``at_m`` and ``from_access`` of the mobile crane's place, or of its own way;
        ``jib_on_ground``: whether the jib of a tower crane can lie there in one piece.
    """
    site = revision.plan.site
    subject = Subject(revision.plan, tuple(revision.motions), tuple(revision.context))
    areas: dict[str, shapely.Geometry] = {
        "yard": area_of(site, site.yard),
        "access": area_of(site, site.access),
        "excavation": area_of(site, site.dug_m > 1e-6),
    }
    if revision.config is not None and revision.config.areas.plot is not None:
        areas["boundary"] = shapely.Polygon(revision.config.areas.plot)
    result = []
    for n, there in sorted(subject.stands(), key=lambda one: one[0]):
        crane = site.cranes[n]
        base, own = base_of(crane), outline_of(crane)
        is_high = tail_low_m(crane) > crane.base_m[2] + STANDING_M
        things = [one for one in there.things if not (is_high and one.kind == "stored")]
        found = [*of_crane(crane, things), *to_areas(crane, areas)]
        found += to_cranes(site, n) if site.moving is None else []
        rooms = (
            _way(there, crane, finished=done)
            if crane.kind == "mobile"
            else place_beside(site, crane, base.edge_m, finished=done)
            for done in (False, True)
        )
        result.append(
            {
                "crane": crane.name,
                "kind": crane.kind,
                "base": {"edge_m": round(base.edge_m, 3), "stated": base.stated},
                "tail": dict(
                    zip(
                        ("radius_m", "low_m", "high_m"),
                        rounded((own.tail_m, tail_low_m(crane), own.tail_height_m[1])),
                        strict=True,
                    )
                ),
                "least_m": TRAPPED_M,
                "distances": [one.to_dict() for one in found],
                **{key: _room(one) for key, one in zip(("erection", "dismantling"), rooms, strict=True)},
                "jib_on_ground": None
                if crane.kind == "mobile"
                else room_for_jib(site, crane, base.edge_m, finished=True).value,
            }
        )
    return result


def _way(there: Subject, crane: TowerCrane, *, finished: bool) -> Place:
    """Return the way of a mobile crane to its place, or away: of one that moves, when it leaves its set-up."""
    if there.site.moving is None:
        return way_in(there.site, crane, finished=finished)
    return way_among(there.site, crane, there.in_place if finished else ())


def _room(place: Place) -> dict[str, Any]:
    at_m = None if place.at_m is None else rounded(place.at_m)
    return {"room": place.room.value, "at_m": at_m, "from_access": place.from_access}


def base_words(one: dict[str, Any]) -> str:
    """Return what a crane stands on, in words."""
    edge = number(one["base"]["edge_m"], f"{one['base']['edge_m']:.3g} m", "base_edge_m")
    if one["kind"] == "mobile":
        return f"outriggers, {edge} square"
    if one["base"]["stated"]:
        return f"foundation, {edge} square, as the site file or the machine file states it"
    return f"foundation, {edge} square: assumed, four times the mast; the crane's supplier states it"


def tail_words(one: dict[str, Any]) -> str:
    """Return radius and height of what swings behind a crane."""
    tail = one["tail"]
    radius = number(tail["radius_m"], f"{tail['radius_m']:.2f} m", "tail_radius_m")
    low = number(tail["low_m"], f"{tail['low_m']:.2f} m", "tail_low_m")
    return f"sweeps {radius} about the axis, underside of the counterweight at z {low}"


def room_words(one: dict[str, Any]) -> str:
    """Return where a mobile crane has room to erect and to dismantle a crane, or its own way."""
    first, last = (_room_words(one, key) for key in ("erection", "dismantling"))
    before, after = ("way in", "way out") if one["kind"] == "mobile" else ("erection", "dismantling")
    words = f"{before}: {first}; {after}, when the building stands: {last}"
    return words + (f"; jib in one piece on the ground: {_JIB[one['jib_on_ground']]}" if one["jib_on_ground"] else "")


_JIB = {"free": "room", "unknown": "only beyond the site as modelled", "none": "no room, in pieces"}


def _room_words(one: dict[str, Any], key: str) -> str:
    found = one[key]
    if found["room"] == "none":
        return "<b>✕ no room</b>"
    begins = "from the access of trucks" if found["from_access"] else "from the edge of the site"
    beyond = " (only beyond the site as modelled: check it)" if found["room"] == "unknown" else ""
    if one["kind"] == "mobile":
        return f"free {begins}{beyond}"
    x, y = found["at_m"]
    return f"{PLACE_M:g} x {PLACE_M:g} m about ({x:.1f}, {y:.1f}), way {begins}{beyond}"


def distances(one: dict[str, Any]) -> str:
    """Return the table of the clear distances of a crane; empty without any."""
    found = {(each["to"], each["from"]): each for each in reversed(_nearest_first(one["distances"]))}
    kinds = [kind for kind in _KINDS if any(kind == to for to, _ in found)]
    pieces = [piece for piece in _PIECES if any(piece == own for _, own in found)]
    if not kinds:
        return ""
    base = "outriggers" if one["kind"] == "mobile" else "foundation"
    heads = {
        "mast": "mast's face",
        "base": base,
        "tail": "counterweight,\naside",
        "below tail": "counterweight,\nbelow",
    }
    rows = [row([_KINDS[kind], *(_cell(one, found.get((kind, piece))) for piece in pieces)]) for kind in kinds]
    about = (
        f"Clear distances, m, at the heights of each piece: {one['least_m']:g} m at least from the counterweight, so "
        "that nobody is trapped (DGUV Vorschrift 52). Obstructions count with their clearance; below 0: beyond the "
        "boundary. ✕: too near."
    )
    columns = ("From", *(heads[piece] for piece in pieces))
    return table(columns, rows, class_="words", id_="clear-distances") + paragraph(about, "faint")


def _nearest_first(found: list[dict[str, Any]]) -> list[dict[str, Any]]:
    return sorted(found, key=lambda one: one["distance_m"])


def _cell(one: dict[str, Any], found: dict[str, Any] | None) -> str:
    if found is None:
        return "–"
    value = number(found["distance_m"], fixed(found["distance_m"], 2), "clear_distance_m")
    solid = found["to"] in ("building", "structure", "obstruction", "stored")
    # The counterweight moves past things; the foundation must not meet any.
    least_m = {"tail": one["least_m"], "base": 1e-3, "mast": 1e-3}.get(found["from"], 0.0)
    mark = "✕ " if solid and found["distance_m"] < least_m else ""
    name = f" to {escape(found['name'])}" if found["name"] else ""
    return f"{mark}{value}{name}"
