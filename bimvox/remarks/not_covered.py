"""What a plan does not cover, each as a line that a person ticks: one table, with what it means for this plan."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeAlias

from bimvox.crane.outline import highest_point_m, outline_of
from bimvox.errors import listed
from bimvox.planning.stage import refused_by_crane
from bimvox.records.declared import Record
from bimvox.records.lift import Lift, LiftPlan, Status
from bimvox.remarks.subject import Subject, metres, name_of
from bimvox.site.component import Component
from bimvox.site.crane_distances import base_of
from bimvox.site.crane_room import PLACE_M, REACH_M, WAY_M, Room, place_beside, room_for_jib, way_in
from bimvox.site.crew_times import TRIAL_LIFT_S
from bimvox.site.means import Means
from bimvox.site.work import Work, work_of


@dataclass(frozen=True, slots=True)
class NotCovered:
    """A line to be ticked.

    Attributes:
        code: Short stable name, for programs.
        topic: What it is about, in a few words.
        text: What a person checks or does, and what it means for this plan.
        components: Ids of the parts of this plan that it is about; none: the whole plan.
    """

    code: str
    topic: str
    text: str
    components: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """Return the line as ``bimvox plan --json``, ``verify --json``, the report and the page give it."""
        return NOT_COVERED.of(self)


NOT_COVERED = Record(
    "PageNotCovered",
    "What the plan does not cover: a line that a person ticks.",
    ("code", str, "Its rule."),
    ("topic", str, "What it is about."),
    ("text", str, "What a person checks or does, and what it means for this plan."),
    ("components", tuple[str, ...], "Ids of the parts that it is about.", lambda it: list(it.components), ()),
)

_Here: TypeAlias = str | tuple[str, Sequence[Component]] | None
"""What a line means for a plan: a sentence, and the parts that it is about; None: nothing beyond the line."""
_NAMED = 3
_LOW_INTENSITY_M = 45.0
"""Up to this height obstacle lights are of low intensity (ICAO Annex 14, volume I, chapter 6)."""
_HELD = (Work.WALL, Work.COLUMN)
"""What stands on its foot, and is braced before it is released."""


class Row(NamedTuple):
    """A row of the table.

    Attributes:
        code: Short stable name.
        topic: What it is about.
        sentence: What a person checks or does, of any plan.
        here: Returns what it means for this plan.
        with_crane: Whether it is only about plans with a crane.
    """

    code: str
    topic: str
    sentence: str
    here: Callable[[Subject], _Here] = lambda _: None
    with_crane: bool = True


def not_covered_by(plan: LiftPlan, context: Collection[Lift] = ()) -> tuple[NotCovered, ...]:
    """Return what a plan does not cover, in the order of the table.

    The values of the plan make sense (``bimvox.proof.values``); ``context`` are lifts of it that it does not contain.
    """
    subject = Subject(plan, (), tuple(context))
    return tuple(_line(row, subject) for row in _ROWS if subject.site.cranes or not row.with_crane)


def _line(row: Row, subject: Subject) -> NotCovered:
    here = row.here(subject)
    said, parts = ("", ()) if here is None else (here, ()) if isinstance(here, str) else here
    text = " ".join(filter(None, (row.sentence, said)))
    return NotCovered(row.code, row.topic, text, tuple(part.id for part in parts))


def _about(parts: Sequence[Component], one: str, many: str) -> _Here:
    """Return a sentence about parts of this plan, with the names of the first ones; None about none."""
    if not parts:
        return None
    count, said = len(parts), one if len(parts) == 1 else many
    names = list(dict.fromkeys(map(name_of, parts)))  # many parts may have one name
    more = ", ..." if len(names) > _NAMED else ""
    return f"Here: {count:,} {said}: {', '.join(names[:_NAMED])}{more}.", parts


def _parts(subject: Subject, lifts: Iterable[Lift]) -> list[Component]:
    return [subject.site.components[lift.component] for lift in lifts]


def _tandem(subject: Subject) -> _Here:
    """Return the parts that no single crane of the site carries to their places."""
    refused = [lift for lift in subject.plan.lifts_with(subject.context) if lift.status is Status.INFEASIBLE]
    parts = [part for part in _parts(subject, refused) if refused_by_crane(subject.site, part) is not None]
    over = sum(lift.flip is not None for lift in subject.lifts)
    by_two = [lift for lift in subject.lifts if lift.tandem is not None]
    if by_two and not parts:
        carried = _parts(subject, by_two)
        return _about(carried, "part that two cranes carry together", "parts that two cranes carry together")
    if over and not parts:
        return f"Here: {over:,} hang{'s' if over == 1 else ''} on both hooks of one crane while being turned over."
    return _about(parts, "part that no crane here lifts alone", "parts that no crane here lifts alone")


def _upended(subject: Subject) -> _Here:
    lying = [lift for lift in subject.lifts if lift.place is not None and lift.place.is_upended and lift.flip is None]
    parts = _parts(subject, lying)
    if not parts and any(lift.flip is not None for lift in subject.lifts):
        return "Here: every part that lies is turned over between two hooks, and its shares are proven."
    takes = f"in {subject.site.rules.upend_s:g} s besides the crane's motion"
    return _about(parts, f"part is upended, {takes}", f"parts are upended, each {takes}")


def _overlaps(subject: Subject) -> _Here:
    count = len(subject.plan.clashes)
    return f"Here: {count:,} pair{' is' if count == 1 else 's are'} drawn into each other." if count else None


def _dug(subject: Subject) -> _Here:
    deepest_m = float(subject.site.dug_m.max(initial=0.0))
    return f"Here: excavated down to {metres(deepest_m)}." if deepest_m > 1e-6 else None


def _obstructions(subject: Subject) -> _Here:
    count = sum(blocker.kind == "obstruction" for blocker in subject.site.blockers)
    return (
        f"Here: {count:,} obstruction{'' if count == 1 else 's'}, and nothing else."
        if count
        else "Here: no obstruction is given."
    )


def _highest(subject: Subject) -> _Here:
    """Return how high the highest crane is, and which obstacle lights that asks for."""
    highest_m, name = max((highest_point_m(crane) - crane.base_m[2], crane.name) for crane in subject.site.cranes)
    light = "low" if highest_m <= _LOW_INTENSITY_M else "medium"
    return (
        f"Here: {name} is up to {metres(highest_m)} high above its foot; obstacle lights would be of {light} intensity."
    )


def _swept(subject: Subject) -> _Here:
    said = (f"{crane.name} sweeps a circle of {metres(outline_of(crane).jib_end_m)}" for crane in subject.site.cranes)
    return f"Here: {listed(said, _NAMED)}."


def _braced(subject: Subject) -> _Here:
    parts = [part for part in subject.lifted if work_of(part) in _HELD]
    return _about(parts, "wall or column", "walls and columns")


def _loaded_aside(subject: Subject) -> _Here:
    parts = [part for part in subject.lifted if work_of(part) is Work.BEAM]
    return _about(parts, "beam that floors may load on one side first", "beams that floors may load on one side first")


def _assumed_points(subject: Subject) -> _Here:
    parts = [part for part in subject.lifted if part.lifting.source != "anchors"]
    return _about(parts, "part has assumed lifting points", "parts have assumed lifting points")


def _cast(subject: Subject) -> _Here:
    parts = [part for part in subject.in_place if part.means is not Means.CRANE]
    return _about(parts, "part is cast, built or set by hand", "parts are cast, built or set by hand")


_SAID = {
    Room.FREE: "there is room",
    Room.UNKNOWN: "room only beyond the site as it is modelled, which a person checks",
    Room.NONE: "NO ROOM",
}


def _comes_and_goes(subject: Subject) -> _Here:
    """Return what was found of the room for the mobile crane before and after the building stands."""
    site, said = subject.site, []
    place = f"a place of {PLACE_M:g} x {PLACE_M:g} m within {REACH_M:g} m of the mast, way {WAY_M:g} m wide"
    if site.moving is not None:
        return "The ways of the crane to and from its set-ups are among the remarks, looked for on the grid."
    for crane in site.cranes:
        if crane.kind == "mobile":
            found, what = [way_in(site, crane, finished=done) for done in (False, True)], f"its way, {WAY_M:g} m wide"
        else:
            edge_m, what = base_of(crane).edge_m, place
            found = [place_beside(site, crane, edge_m, finished=done) for done in (False, True)]
        before, after = (_SAID[one.room] for one in found)
        both = before if before == after else f"{before} before, {after} when the building stands"
        said.append(f"{crane.name}, {what}: {both}{' before and after' if before == after else ''}")
        if crane.kind != "mobile":
            jib = room_for_jib(site, crane, base_of(crane).edge_m, finished=True)
            said.append(f"its jib of {metres(crane.jib_own_m)} in one piece on the ground: {_SAID[jib]}")
    return f"Looked for on the grid: {'; '.join(said)}."


# fmt: off
_ROWS = (
    Row("tandem", "Tandem lifts",
        "A lift hangs on one hook of one crane, unless the plan states that two cranes carry it. What one of them does "
        "to the other, and what happens if one stops alone, no plan covers.",
        _tandem),
    Row("two_hooks", "Turning over between two hooks",
        "A part that lies is upended with one hook, about its foot, which must not slip: on level ground, timber or a "
        "tilting frame. Whether its anchors bear that pull, and whether a part must be turned over between two hooks, "
        "its designer says.", _upended),
    Row("tolerances", "Tolerances",
        "Parts have the dimensions of the model. Tolerances of making, setting out and erection, widths of joints, "
        "packs and levels are checked before the lift.", _overlaps, with_crane=False),
    Row("services_below", "Services below the ground",
        "Find pipes, cables, ducts and cellars below crane, outriggers, ways and yard, and protect or divert them.",
        _dug, with_crane=False),
    Row("services_above", "Overhead lines",
        "Only what is given as an obstruction is kept clear of. Ask the owner of each line for its distance, or have "
        "it switched off.", _obstructions, with_crane=False),
    Row("aviation", "Aviation",
        "Tell the aerodromes nearby and the aviation authority before the crane stands, as they ask for; mark and "
        "light it as they say.", _highest),
    Row("neighbours", "Neighbours, other cranes",
        "Agree with the neighbours whose ground the jib sweeps, and with the operators of cranes that are not in this "
        "plan.", _swept),
    Row("ground", "Bearing of the ground",
        "Have the ground tested or calculated below crane, outriggers, ways of lorries, stacks and racks."),
    Row("support", "Foundation, ties, mats",
        "The crane's supplier states foundation, ballast, ties or mats for this height, and who hands them over."),
    Row("erection", "Crane: way in, erecting, dismantling",
        "The supplier's method: way in, place and ground of the mobile crane, where the jib is assembled, road "
        "closures, climbing; and how all of it goes away again when the building stands.", _comes_and_goes),
    Row("public", "People and traffic",
        "Barriers, marshals, closed ways and roads keep everybody out of the exclusion zone; nobody stands where the "
        "counterweight swings."),
    Row("bracing", "Braces and props",
        "The designer confirms props, their places, anchors, the strength of floor and ground below them, wind while "
        "they stand, floors below that need back-propping, and when they go; nothing is released before it is held.",
        _braced, with_crane=False),
    Row("eccentric", "Eccentric loads, torsion of beams",
        "Floors load fresh columns, walls and beams on one side first. The designer confirms that these and their "
        "props bear that and that no beam twists, and says in which order both sides are loaded: the loads of props in "
        "this plan are wind and 2 % of the weight alone.", _loaded_aside, with_crane=False),
    Row("anchors", "Anchors and lifting points",
        "The part's designer states anchors, and the strength that its concrete needs before it is lifted.",
        _assumed_points),
    Row("connections", "Bearings, grout, welds, bolts",
        "Bearings, grout, welds and bolts are accepted before they carry the next part.", with_crane=False),
    Row("heights", "Work at height",
        "Edge protection, ladders, platforms and rescue for those who guide, fix and release the parts.",
        with_crane=False),
    Row("weather", "Weather and light",
        "No lifting in lightning, fog, ice or darkness without what it needs; wind is measured at the jib.",
        with_crane=False),
    Row("inspection", "Inspections and people",
        "Thorough examination of the crane, certificates of gear, and cards of operator, slinger, signaller and "
        "supervisor are valid."),
    Row("other_lifts", "Other loads",
        "Formwork, reinforcement, concrete, tools and materials also need the crane: this plan holds the lifts of the "
        "parts alone.", _cast),
    Row("persons", "Lifting of persons", "Nobody is lifted by this plan, and nobody rides on a load."),
    Row("breakdown", "Breakdown",
        "What is done if crane, power or radio fails with a load on the hook, and who is called. The crane holds every "
        f"load {TRIAL_LIFT_S:g} s just above the ground first: that is when brakes and slings are looked at."),
    Row("loading", "Loading of lorries",
        "How parts lie on a lorry, in which order, and how they are held while others are taken off."),
)
# fmt: on
"""Every line, in the order in which a lifting supervisor goes through them."""
