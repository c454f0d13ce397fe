"""Loads of a crane on its support: from the load, and from the masses that machine file and site file state.

The method is static, without dynamic factors, wind on the crane, and load cases out of service:

- vertical: (crane + everything on the hook) g;
- overturning: everything on the hook, times its radius, less the crane's own moment towards the counterweight;
- slewing: everything on the hook as a point at its radius, at the highest acceleration of the slewing axis;
- outriggers: by the statics of a rigid body on four pads, from masses and geometry of the machine file
  (``bimvox.crane.ground``); without them 0.65 of the vertical load on one, by the Queensland Mobile Crane Code of
  Practice, as the Crane Industry Council of Australia quotes it (cranesandlifting.com.au, "Determining the suitable
  size for outrigger mats");
- mat pressure: that force over the mat's area (T. C. Smith, Mesa Associates, 2014).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from bimvox.crane.carrier import Stand
from bimvox.crane.ground import G_M_S2
from bimvox.crane.outline import CraneOutline, outline_of
from bimvox.errors import listed
from bimvox.records.motion import by_each_crane
from bimvox.rendering.page.source import Revision
from bimvox.rendering.report.html import number, paragraph, row, section, table, tag, terms, value
from bimvox.rendering.report.outriggers import most_kn, pads_of, pads_table
from bimvox.rendering.report.site_plan import GEOREFERENCE, georeference_of
from bimvox.rendering.report.words import fixed
from bimvox.rendering.words import escape
from bimvox.site.config.project import SupportConfig, support_of
from bimvox.site.config.site_config import ModelConfig, SiteConfig
from bimvox.site.lifting import hung_kg
from bimvox.site.map_frame import map_of_model, set_out
from bimvox.site.site import Site
from bimvox.site.tandem import part_on

OUTRIGGER_SHARE = 0.65
_MISSING = "not stated by the machine file: from the manufacturer"


def supports_of(revision: Revision) -> list[dict[str, Any]]:
    """Return the loads of each crane that lifts something; None for what follows from masses that nobody states.

    Returns:
        ``crane, kind, hung_kg, hook_m`` (highest hook above the foot), ``vertical_load_kn, load_moment_knm,
        load_moment_number, radius_m, slewing_knm``; ``pads`` (``pads_of``; None if the machine file does not state
        masses), ``stand`` (of a tower crane, as its machine file states it), what is stated (``SupportConfig``), and
        from it ``vertical_kn, moment_knm, outrigger_kn, mat_kpa, needed_m2``.
    """
    site, given = revision.plan.site, revision.config.support if revision.config else ()
    result = []
    for index, crane in enumerate(site.cranes):
        own = [motion for motion in by_each_crane(revision.motions) if motion.crane == index]
        if not own:
            continue
        hung = {motion.order: hung_kg(crane, part_on(site, motion.component, index)) for motion in own}
        radius_m = {m.order: float(max(m.raising.radius_m.max(), m.loaded.radius_m.max())) for m in own}
        worst = max(hung, key=lambda order: (hung[order] * radius_m[order], -order))
        inertia_kg_m2 = max(hung[order] * radius_m[order] ** 2 for order in hung)
        stated = support_of(given, crane.name, crane.machine or crane.name, is_first=index == 0)
        loads = {
            "crane": crane.name,
            "kind": crane.kind,
            "hung_kg": max(hung.values()),
            "vertical_load_kn": max(hung.values()) * G_M_S2 / 1e3,
            "load_moment_knm": hung[worst] * radius_m[worst] * G_M_S2 / 1e3,
            "load_moment_number": worst + 1,
            "radius_m": radius_m[worst],
            "hook_m": crane.highest_hook_m - crane.base_m[2],
            "slewing_knm": inertia_kg_m2 * crane.slewing.acceleration / 1e3,
        }
        pads = pads_of(crane, own, hung)
        result.append(loads | _with_crane(loads, stated or SupportConfig(), pads, crane.stand))
    return result


def _with_crane(
    loads: dict[str, Any], stated: SupportConfig, pads: dict[str, Any] | None, stand: Stand | None
) -> dict[str, Any]:
    """Return what site file and machine file state, and what follows from it."""
    mass_kg, mat_m2 = stated.crane_mass_kg, stated.mat_m2
    if mass_kg is None and pads is not None:
        mass_kg = pads["crane_kg"]
    if mass_kg is None and stand is not None and stand.mass_kg is not None:
        mass_kg = stand.mass_kg + (stand.ballast_kg or 0.0)
    vertical_kn = None if mass_kg is None else mass_kg * G_M_S2 / 1e3 + loads["vertical_load_kn"]
    on_outriggers = loads["kind"] == "mobile" and vertical_kn is not None
    outrigger_kn = OUTRIGGER_SHARE * vertical_kn if on_outriggers and vertical_kn is not None else None
    if pads is not None:
        outrigger_kn = most_kn(pads)
    back_knm = stated.back_moment_knm
    moment_knm = None if pads is None else pads["overturning_knm"]
    if back_knm is not None:
        moment_knm = max(loads["load_moment_knm"] - back_knm, back_knm)
    free_m = stated.free_standing_m
    return {
        **stated.model_dump(exclude={"crane"}),
        "crane_mass_kg": mass_kg,
        "free_standing_m": stand.free_standing_m if free_m is None and stand is not None else free_m,
        "pads": pads,
        "stand": None if stand is None else asdict(stand),
        "vertical_kn": vertical_kn,
        "moment_knm": moment_knm,
        "outrigger_kn": outrigger_kn,
        "mat_kpa": None if outrigger_kn is None or mat_m2 is None else outrigger_kn / mat_m2,
        "needed_m2": None
        if outrigger_kn is None or stated.permitted_kpa is None
        else outrigger_kn / stated.permitted_kpa,
    }


def support(record: dict[str, Any]) -> str:
    """Return the section on foundation, outriggers and ground; empty without a crane that lifts."""
    shown = [_crane(one) for one in record["support"]]
    if not shown:
        return ""
    about = (
        "Static loads in service of this plan, without dynamic factors, wind on the crane, ties, and load cases out of "
        "service, unless the maker's are stated: the manufacturer's table of corner and foundation loads governs. "
        "docs/report-rules.md has the method."
    )
    return section(
        "Loads on foundation and ground",
        paragraph(about, "faint"),
        *(tag("h3", escape(one["crane"])) + html for one, html in zip(record["support"], shown, strict=True)),
        id="support",
    )


def _crane(one: dict[str, Any]) -> str:
    def stated(key: str, digits: int, unit: str) -> str:
        return _MISSING if one[key] is None else number(one[key], f"{fixed(one[key], digits)} {unit}", key)

    hung = value(one, "vertical_load_kn", 0, " kN")
    moment = value(one, "load_moment_knm", 0, " kNm")
    where = f"lift {one['load_moment_number']} at {one['radius_m']:.1f} m"
    slewing = value(one, "slewing_knm", 0, " kNm")
    pairs = [
        ("On the hook", f"{hung} at most: load, rigging and hook block"),
        ("Load moment", f"{moment} about the slewing axis ({where})"),
        ("Slewing moment", f"{slewing} from the load alone, at the highest acceleration of the axis"),
        ("Crane's mass", "–" if one["crane_mass_kg"] is None else f"{fixed(one['crane_mass_kg'] / 1e3, 1)} t"),
        ("Vertical", stated("vertical_kn", 0, "kN")),
        ("Overturning", stated("moment_knm", 0, "kNm, the larger of with and without load")),
    ]
    if one["kind"] != "mobile":
        pairs += [("Ties", _ties(one)), *_stand(one["stand"])]
    if one["kind"] == "mobile":
        pairs += [
            ("On an outrigger", stated("outrigger_kn", 0, "kN: " + _outrigger_words(one["pads"]))),
            ("Mat pressure", stated("mat_kpa", 0, "kPa") if one["mat_m2"] else "the mat's area is not stated"),
            ("Mat needed", stated("needed_m2", 2, "m²") if one["permitted_kpa"] else "no permitted pressure stated"),
        ]
        pressure, permitted = one["mat_kpa"], one["permitted_kpa"]
        if pressure is not None and permitted is not None and pressure > permitted:
            pairs.append(
                ("Ground", f"<b>✕ the mat presses {fixed(pressure, 0)} kPa; {permitted:g} kPa are permitted</b>")
            )
    return terms(pairs) + ("" if one["pads"] is None else pads_table(one["pads"], one["mat_m2"]))


def _outrigger_words(pads: dict[str, Any] | None) -> str:
    """Return how the load on an outrigger follows, and in how many lifts a pad carries nothing."""
    if pads is None:
        return "0.65 of the vertical load"
    off = f"; {pads['lifts_off']} lifts take all load off a pad, so three carry" if pads["lifts_off"] else ""
    return f"the largest in this plan, by masses and geometry of the machine file{off}"


_LOADS = (
    ("vertical_kn", "vertical", "kN"),
    ("horizontal_kn", "horizontal", "kN"),
    ("moment_knm", "overturning", "kNm"),
    ("slewing_knm", "slewing", "kNm"),
    ("corner_kn", "largest corner", "kN"),
)


def _stand(stand: dict[str, Any] | None) -> list[tuple[str, str]]:
    """Return base, ballast and the maker's loads on the foundation of a tower crane; what is not stated is named."""
    own = stand or {}
    ballast_kg = own.get("ballast_kg")
    pairs = [
        ("Base", escape(own.get("base") or "") or _MISSING),
        ("Ballast", _MISSING if ballast_kg is None else number(ballast_kg, f"{ballast_kg / 1e3:.1f} t", "ballast_kg")),
    ]
    for key, name in (("in_service", "Maker's loads in service"), ("out_of_service", "Maker's loads out of service")):
        given = own.get(key) or {}
        words = [
            f"{what} {number(given[load], f'{fixed(given[load], 0)} {unit}', f'{key}.{load}')}"
            for load, what, unit in _LOADS
            if given.get(load) is not None
        ]
        missing = [what for load, what, _ in _LOADS if given.get(load) is None]
        words += [f"{', '.join(missing)}: {_MISSING}"] if missing else []
        pairs.append((name, "; ".join(words)))
    return pairs


def _ties(one: dict[str, Any]) -> str:
    """Return whether the crane stands without ties, as far as that is stated."""
    hook = number(one["hook_m"], f"{one['hook_m']:.1f} m", "hook_m")
    free_m = one["free_standing_m"]
    if free_m is None:
        return f"highest hook {hook} above the foot; free-standing height {_MISSING}"
    limit = number(free_m, f"{free_m:g} m", "free_standing_m")
    stands = f"highest hook {hook} above the foot, free-standing up to {limit}"
    if one["hook_m"] <= free_m:
        return f"none needed: {stands}"
    return f"<b>✕ needed: {stands}; number, heights and loads of the ties: from the manufacturer</b>"


# What a surveyor sets out: cranes, yard, construction area and zones in map coordinates.

_ZONE = {
    "prohibited": "no hook above",
    "no_load": "no load above",
    "public": "neither hook nor load above",
    "slow": "reduced rates",
    "limiter": "hook height limited",
    "assembly": "assembly zone",
}


def survey_of(revision: Revision, areas: dict[str, Any]) -> dict[str, Any] | None:
    """Return what is set out, in map coordinates: ``set_out`` with ``crs``; None if the model has no map conversion.

    ``areas``: the outlines of the drawing, for areas that the site file leaves to be chosen.
    """
    site = revision.plan.site
    stated = revision.metadata.get(GEOREFERENCE, "")
    to_map = map_of_model(stated, site.source)
    if to_map is None:
        return None
    config = revision.config or SiteConfig(model=ModelConfig(path=Path("model")))
    chosen = {"yard": areas.get("yard"), "construction": next(iter(areas.get("construction", ())), None)}
    missing = {key: value for key, value in chosen.items() if getattr(config.areas, key) is None}
    config = config.model_copy(update={"areas": config.areas.model_copy(update=missing)})
    return {"crs": georeference_of(stated).get("crs"), **set_out(config, site.cranes, site.site_to_ifc, to_map)}


def survey(record: dict[str, Any]) -> str:
    """Return the section of map coordinates; empty if the model has no map conversion."""
    found = record["survey"]
    if found is None:
        return ""
    points: list[tuple[str, str, Sequence[float]]] = [
        (f"{name}, slewing axis", "", at) for name, at in found["cranes"].items()
    ]
    rings = [("yard" if len(found["yard"]) == 1 else f"yard {n}", one) for n, one in enumerate(found["yard"], 1)]
    access = found.get("access", [])
    rings += [("access" if len(access) == 1 else f"access {n}", one) for n, one in enumerate(access, 1)]
    rings += [("construction area", found["construction"])] if found["construction"] else []
    rings += [
        (f"zone {n}: {one['name'] or _ZONE[one['kind']]}", one["corners"]) for n, one in enumerate(found["zones"], 1)
    ]
    points += [(name, str(n), at) for name, ring in rings for n, at in enumerate(ring, 1)]
    rows = [
        row([escape(name), corner, *(number(value, f"{value:.3f}", key) for key, value in zip("ENH", at, strict=True))])
        for name, corner, at in points
    ]
    crs = f" in {found['crs']}" if found["crs"] else ""
    about = (
        f"Easting, northing and height in metres{crs}, by the model's map conversion; heights are those of the ground "
        "(z = 0), of a crane that of its foot. A surveyor checks the conversion against a point on the site."
    )
    shown = table(("Point", "Corner", "E m", "N m", "H m"), rows, class_="words narrow", id_="survey-points")
    return section("Setting out", paragraph(about, "faint"), tag("div", shown, "wide"), id="survey")


# Out of service: how a crane is left, the circle that it needs, what stands in it, and from which wind on.
#
# A tower crane is left free to slew with the wind (CPA alert, theconstructionindex.co.uk, "Tower crane guidance for
# mothballed sites"; HSE alert, cranestodaymagazine.com), so that its jib needs its whole circle.

_NAMED = 5


def out_of_service(revision: Revision) -> list[dict[str, Any]]:
    """Return what each crane needs out of service.

    Returns:
        ``crane, kind, wind_m_s`` (gust from which it does not work), ``radius_m`` of the circle of jib and counter-jib,
        ``low_m`` (their lowest point), and ``meets``: names of parts, obstructions, structure and other cranes that
        reach into the circle at that height. A mobile crane is not left standing: its circle is None.
    """
    site, result = revision.plan.site, []
    for index, crane in enumerate(site.cranes):
        own = outline_of(crane)
        swings = crane.kind != "mobile"
        low_m = min(own.jib_m[0], own.tail_height_m[0])
        radius_m = max(own.jib_end_m, own.tail_m)
        result.append(
            {
                "crane": crane.name,
                "kind": crane.kind,
                "wind_m_s": crane.max_wind_m_s,
                "radius_m": radius_m if swings else None,
                "low_m": low_m if swings else None,
                "meets": list(_meets(site, index, own, radius_m, low_m)) if swings else [],
            }
        )
    return result


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
    meets = "check at that radius" if one["kind"] == "luffing" else "not free to slew"
    return f"{words}. <b>✕ {meets}: {escape(listed(one['meets'], _NAMED))}</b>"
