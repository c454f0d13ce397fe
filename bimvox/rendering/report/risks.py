"""The category of each lift, and the risks of a plan with what it does about them and what is left to the site."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

from bimvox.errors import listed
from bimvox.records.proof import Severity
from bimvox.rendering.report.html import paragraph, row, section, table
from bimvox.rendering.report.words import ranges
from bimvox.rendering.words import counted, escape

COMPLEX, INTERMEDIATE, BASIC = "complex", "intermediate", "basic"
_LETTERS = {COMPLEX: "C", INTERMEDIATE: "I", BASIC: "B"}
_STANDING = ("column", "wall")
"""Classes of work that stand on braces when their slings come off."""
_LISTED = 12

_Lift = Mapping[str, Any]


class _Rule(NamedTuple):
    """Why a lift is of a category, and of which lifts that holds; ``about`` are what the remarks say of its part."""

    category: str
    why: str
    holds: Callable[[_Lift, frozenset[str]], bool]


def _of_kind(kind: str) -> Callable[[_Lift, frozenset[str]], bool]:
    return lambda _, about: kind in about


_RULES = (
    _Rule(COMPLEX, "critical by its utilisation", lambda lift, _: bool(lift["critical"])),
    _Rule(COMPLEX, "guided: tilted and held aside", _of_kind("guided")),
    _Rule(COMPLEX, "carried by two cranes", _of_kind("two_cranes")),
    _Rule(COMPLEX, "a serious remark", _of_kind(Severity.SERIOUS.value)),
    _Rule(COMPLEX, "out of the operator's sight", _of_kind("blind")),
    _Rule(INTERMEDIATE, "upended", lambda lift, _: lift["stored"] not in (None, "as_built")),
    _Rule(INTERMEDIATE, "less clearance than the rule", _of_kind("small_clearance")),
    _Rule(INTERMEDIATE, "less wind than others", _of_kind("low_wind")),
    _Rule(INTERMEDIATE, "mass not stated", lambda lift, _: lift["mass_source"] != "quantity"),
    _Rule(INTERMEDIATE, "braced before its release", _of_kind("stands")),
)
"""The load and its surroundings decide (BS 7121-1, as Cranes Today quotes it); which features count is professional
judgement. A lift without any of them is basic."""


def with_categories(
    lifts: Iterable[dict[str, Any]],
    remarks: Iterable[_Lift],
    blind_lifts: Iterable[_Lift],
    method: Iterable[_Lift],
) -> list[dict[str, Any]]:
    """Return the lifts of a record with ``category`` and ``category_why``; None and empty for what is not planned."""
    about: dict[str | None, set[str]] = {}
    for remark in remarks:
        about.setdefault(remark["component"], set()).update((remark["kind"], remark["severity"]))
    blind = {one["number"] for one in blind_lifts}
    stands = {number for one in method if one["work"] in _STANDING for number in one["lifts"]}
    result = []
    for lift in lifts:
        said = about.get(lift["id"], set())
        said |= {word for word, numbers in (("blind", blind), ("stands", stands)) if lift["number"] in numbers}
        result.append(lift | _category(lift, frozenset(said)))
    return result


def _category(lift: _Lift, about: frozenset[str]) -> dict[str, Any]:
    if lift["status"] != "planned":
        return {"category": None, "category_why": []}
    held = [rule for rule in _RULES if rule.holds(lift, about)]
    category = next((one for one in (COMPLEX, INTERMEDIATE) if any(rule.category == one for rule in held)), BASIC)
    return {"category": category, "category_why": [rule.why for rule in held]}


def letter_of(category: str | None) -> str:
    """Return the letter of a category; empty for None."""
    return "" if category is None else _LETTERS[category]


def in_short(record: dict[str, Any]) -> str:
    """Return how many lifts are of each category."""
    found = [lift["category"] for lift in record["lifts"]]
    return ", ".join(f"{found.count(one):,} {one}" for one in (COMPLEX, INTERMEDIATE, BASIC) if one in found)


def categories(record: dict[str, Any]) -> str:
    """Return how many lifts are of each category, and why, as HTML."""
    planned = [lift for lift in record["lifts"] if lift["category"]]
    words = []
    for category in (COMPLEX, INTERMEDIATE, BASIC):
        own = [lift for lift in planned if lift["category"] == category]
        if not own:
            continue
        rules = [rule for rule in _RULES if rule.category == category]
        whys = [(rule.why, sum(rule.why in lift["category_why"] for lift in own)) for rule in rules]
        said = listed((f"{why}: {count:,}" for why, count in whys if count), _LISTED)
        words.append(f"{len(own):,} {category}" + (f" ({said})" if said else ""))
    return escape("; ".join(words)) + ". Proposed; the appointed person decides" if words else ""


# Risks: what this plan does about each, and what is done on site.


class _Risk(NamedTuple):
    name: str
    where: str
    plan: str
    site: str


def risks(record: dict[str, Any]) -> str:
    """Return the section of risks and measures; empty for a plan without a crane."""
    if record["crane"] is None:
        return ""
    rows = [row([escape(one.name), *map(escape, one[1:])]) for one in _risks(record)]
    about = (
        "What the plan does against each risk, and what is left to be done on site. A competent person completes it."
    )
    columns = ("Risk", "Here", "What this plan does", "What is done on site")
    return section(
        "Risks and measures", paragraph(about, "faint"), table(columns, rows, class_="words risks", id_="risks"),
        id="risks-and-measures",
    )  # fmt: skip


def _lifts(lifts: Iterable[_Lift]) -> str:
    """Return which lifts, as numbers."""
    numbers = sorted(lift["number"] for lift in lifts)
    return f"{counted(len(numbers), 'lift')}: {listed(ranges(numbers), _LISTED)}" if numbers else "no lift"


def _risks(record: dict[str, Any]) -> list[_Risk]:
    planned = [lift for lift in record["lifts"] if lift["category"]]
    by_order = {lift["order"]: lift for lift in planned}
    rules, totals = record["site"]["rules"], record["totals"]

    def why(*said: str) -> str:
        return _lifts(lift for lift in planned if set(said) & set(lift["category_why"]))

    blind = [by_order[one["order"]] for one in record["blind"] if one["order"] in by_order]
    used, most = totals["highest_utilisation"], rules["highest_utilisation"]
    least = min((lift["lifting"]["permitted_wind_m_s"] for lift in planned), default=None)
    areas = record["drawing"]["areas_m2"]
    unstated = [lift for lift in planned if lift["mass_source"] != "quantity"]
    tails = [one for crane in record["distances"] for one in crane["distances"] if one["from"] == "tail"]
    nearest = min((one["distance_m"] for one in tails if one["to"] not in ("boundary", "crane")), default=None)
    lying = [lift for lift in planned if lift["stored"] not in (None, "as_built")]
    upended, over = ([lift for lift in lying if ("flip" in lift) == both] for both in (False, True))
    stands = [number for one in record["method"] if one["work"] in _STANDING for number in one["lifts"]]
    found = [
        _Risk("Overload", why("critical by its utilisation") + (f"; at most {100.0 * used:.0f} %" if used else ""),
              f"load, gear and hook block against the chart at every sample; up to {100.0 * most:g} % permitted",
              "rated capacity limiter in force; the load is weighed at the trial lift"),
        *(
            [_Risk("Load shared by two cranes", _lifts(by_two),
                   "share of each by statics, level and out of level, against a part of both load charts; both hooks "
                   "in time with each other, no other lift meanwhile",
                   "one person directs both; both loads read all the way; one command stops both")]
            if (by_two := [lift for lift in planned if lift.get("tandem") is not None]) else []
        ),
        _Risk("Wrong mass", _lifts(unstated) + " without a stated mass",
              "assumed on the safe side, with a remark where it decides",
              "weigh the first part of each kind; compare with the delivery note"),
        _Risk("Falling load", f"{areas['falling']:,.0f} m² may be reached, {areas['falling_outside']:,.0f} m² outside",
              "exclusion zone drawn; gear by limit and angle", "barriers and marshals; nobody below; gear inspected"),
        _Risk("Load out of sight", _lifts(blind), "named", "signaller with radio, who sees the load all the way"),
        _Risk("Wind", (f"least limit {least:.1f} m/s; " if least is not None else "") + why("less wind than others"),
              "limit of each lift by its sail area", "anemometer at the jib; stop at the limit of the lift"),
        _Risk("Load or rope hits something", why("less clearance than the rule", "guided: tilted and held aside"),
              f"path proven at every sample, {rules['transit_clearance_m']:g} m in transit, swing at rest when set",
              "tag lines; stop if something else is in the way"),
    ]  # fmt: skip
    if upended:
        found.append(
            _Risk("Tilting while upended", _lifts(upended), "foot held, rope upright, time for it",
                  "ground or frame under the foot; nobody where it may fall")
        )  # fmt: skip
    if over:
        found.append(
            _Risk("Turned over between two hooks", _lifts(over), "share of each hook at every angle, foot clear of the "
                  "ground, its room kept free", "maker's manual permits it; both loads read; one signaller")
        )  # fmt: skip
    if stands:
        found.append(
            _Risk("Part falls over", f"{len(stands):,} walls and columns",
                  "slings come off after bracing",
                  "braces and fixings by the designer's drawing; checked before release")
        )  # fmt: skip
    said = "nothing within its height" if nearest is None else f"nearest thing {nearest:.2f} m"
    found += [
        _Risk("Trapped by the counterweight", said, f"{record['distances'][0]['least_m']:g} m at least, otherwise a "
              "serious remark", "fence its circle where people can reach it"),
        _Risk("Crane overturns", "foundation, outriggers, ground", "loads of this plan are stated",
              "supplier's foundation or mats; ground tested; handed over in writing"),
    ]  # fmt: skip
    if "cranes" in totals:
        found.append(
            _Risk("Cranes collide", counted(len(totals["cranes"]), "crane"), "separation proven over time, also when "
                  "braking", "anti-collision device set; one coordinator")
        )  # fmt: skip
    return found
