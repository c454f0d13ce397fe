"""Every remark: its code, how much it matters, and its sentence; the rules next to it say when it is made."""

from __future__ import annotations

from typing import NamedTuple

from bimvox.records.proof import ASSUMED_KIND, Remark, Severity
from bimvox.site.component import Component

_SERIOUS, _MINOR, _NOTE = Severity


class Row(NamedTuple):
    """A sentence of a remark.

    Attributes:
        code: Short stable name of its rule, for programs; a rule may have several sentences.
        severity: How much it matters.
        sentence: Its text, with the names of what is filled in.
    """

    code: str
    severity: Severity
    sentence: str

    def __call__(self, part: Component | None = None, **values: object) -> Remark:
        """Return the remark about a part; None: about the whole plan."""
        text = self.sentence.format(**values)
        if part is None:
            return Remark(self.code, self.severity, text)
        return Remark(self.code, self.severity, text, part.id, part.name or part.id)


# fmt: off
# Cranes: machines of the catalogue, feet, loads.
CRANE_GENERIC = Row("crane_generic", _NOTE,
    "crane {crane!r} is a machine of the catalogue with typical data, not a manufacturer's product: its load chart "
    "must be replaced by that of the machine on site")
CRANE_PUBLIC = Row("crane_public", _MINOR,
    "crane {crane!r} is {machine} from public figures: chart from public end points ({source}); between them the "
    "smaller load moment holds. Check it against the machine's own chart. Assumed, as of {like}: {assumed}. Not found: "
    "{not_found}")
CRANE_FICTITIOUS = Row("crane_unknown", _SERIOUS,
    "crane {crane!r} is fictitious, it does not exist: a machine scaled up by calculation ({data}); name a real "
    "machine and give its load chart")
CRANE_TOO_LARGE = Row("crane_unknown", _SERIOUS,
    "crane {crane!r} lifts {moment:,.0f} tm, more than any tower crane ever built ({data})")
CRANE_UNKNOWN = Row("crane_unknown", _MINOR,
    "crane {crane!r} is not in the catalogue ({data}): check its data against the manufacturer's load chart")
_ALTERED = "crane {crane!r} is not {known}{declared}: {differences}"
CRANE_DOES_MORE = Row("crane_altered", _SERIOUS, _ALTERED)
CRANE_ALTERED = Row("crane_altered", _MINOR, _ALTERED)
MAST_MEETS = Row("crane_foot", _SERIOUS, "the mast of crane {crane!r} goes through {first}{more}")
FOOT_OFF = Row("crane_foot", _SERIOUS,
    "the foot of crane {crane!r} is {off:.1f} m {where} the ground there: give its height, or move it clear of the "
    "excavation")
FOOT_INSIDE = Row("crane_foot", _MINOR,
    "crane {crane!r} stands inside the outline of the building: its mast must stay until the end, and its foundation "
    "must fit between the parts")
TAIL_NEAR = Row("crane_tail", _SERIOUS,
    "the counterweight of crane {crane!r} passes {name} at {distance}: a person between them is trapped; {least} are "
    "the least")
TAIL_LOW = Row("crane_tail", _MINOR,
    "the counterweight of crane {crane!r} passes {distance} above {name}: nobody may stand there while it slews")
OUTRIGGER_EDGE = Row("crane_edge", _MINOR,
    "the outriggers of crane {crane!r} are {distance} from the edge of the excavation: {least} are usual without a "
    "calculation")
SET_UP_UNUSED = Row("set_up_unused", _MINOR,
    "set-up {name!r} serves no lift: the crane does not go there, and no time is counted for it")
SET_UP_ON_BUILDING = Row("set_up_ground", _SERIOUS,
    "crane {crane!r} stands on {first}{more}, with {load} on one outrigger: who checks the structure must agree")
SET_UP_AT_EDGE = Row("set_up_ground", _SERIOUS,
    "the outriggers of crane {crane!r} are {distance} from the edge of the excavation, with {load} on one of them: "
    "{least} are usual without a calculation")
NO_PLACE = Row("crane_room", _SERIOUS,
    "when the building stands, no place of {place} by {place} m with a way {way} m wide is left within {reach} m of "
    "the mast of crane {crane!r}: the mobile crane that dismantles it has no room")
NO_WAY = Row("crane_room", _SERIOUS,
    "no way {way} m wide and {high} m high leads {where} the place of crane {crane!r} {when}")
CARRIED_LOW = Row("carried_low", _MINOR, "is carried {gap} over {below}: {least} are usual")
HIGH_UTILISATION = Row("high_utilisation", _MINOR, "uses {share:.0f} % of the capacity of crane {crane!r} {where}")
IF_CONCRETE = Row("doubtful_mass", _SERIOUS,
    "is taken as {kind} ({why}); if it is concrete, it weighs {mass}, {share:.0f} % of the capacity of crane "
    "{crane!r}: say what it is ([model] kinds)")
DOUBTFUL_MASS = Row("doubtful_mass", _SERIOUS,
    "uses {share:.0f} % of the capacity of crane {crane!r}, and its mass of {mass} is an assumption, which may be "
    "{unsure:.0f} % too low: state its weight or material in the model")

# Parts: what holds them, their mass, overlaps, ways by road, guides, racks.
MANY_FLOAT = Row("floats", _SERIOUS,
    "{count:,} parts float {foot} above the ground and touch only each other: foundations are missing in the model, "
    "or [model] ground_m is too low")
FLOATS = Row("floats", _SERIOUS, "floats {foot} above the ground: {neighbours}")
HANGS = Row("hangs", _MINOR, "hangs: nothing is under it, it is held only by what it touches at its sides")
UNHELD = Row("unheld", _SERIOUS, "is set before any part that could hold it")
_WEIGHS = "weighs {mass}, {density} kg/m3 of what it encloses: {than}; check its mass"
ODD_DENSITY = Row("density", _SERIOUS, _WEIGHS)
UNUSUAL_DENSITY = Row("density", _MINOR, _WEIGHS)
STATED_MASS = Row("stated_mass", _SERIOUS,
    "the model states {stated} kg, but by volume and material it weighs {computed} kg: it is planned with {used} kg; "
    "say what it weighs ([[component]] mass_kg)")
OVERLAP = Row("overlap", _SERIOUS, "is drawn {least}{depth:.0f} mm into {other}{more}")
OVERLAP_ON_SITE = Row("overlap", _MINOR, OVERLAP.sentence + "; one of them is cut, cast or built on site")
SMALL_OVERLAPS = Row("small_overlaps", _NOTE,
    "parts overlap in the model by up to {depth:.0f} mm, and may do so when they are set: {count:,} pair{s}")
NOT_HELD = Row("not_held", _SERIOUS,
    "nothing of the plan holds it when its slings come off: {why}; say what does before it is lifted")
NEAR_PROPS = Row("near_props", _MINOR,
    "loads pass its props at {clear}, not {asked}: no place keeps more; they are guided by tag lines, and nobody is "
    "between them")
FIXED_TO = Row("not_held", _MINOR,
    "there is no place for props in every direction: fix it to {names} before its slings come off")
HOLDS_UP = Row("props_in_the_way", _MINOR,
    "its props stand where {names} {is_} built or set by hand: that waits until they go, {when}")
KEEPS_PROPS = Row("keeps_props", _NOTE,
    "{count:,} part{s} keep{v} props until the designer says so: no floor of the plan holds {heads}")
NOT_BY_ROAD = Row("transport", _SERIOUS, "{what}: it cannot go by road in one piece")
SPECIAL_TRANSPORT = Row("transport", _MINOR, "{what}: a special transport with a permit")
HAND_LOAD = Row("hand_load", _MINOR,
    "weighs {mass:.0f} kg: one person carries that, yet it has a crane lift of its own")
BUNDLED = Row("hand_load", _MINOR, "weighs {mass:.0f} kg: such parts are lifted by the bundle, not one by one")
GUIDED = Row("guided", _MINOR,
    "reaches its place only if it is tilted by {tilt:.1f} degrees and held {aside:.2f} m aside, from {top:.1f} m "
    "above it: one sling leg is adjustable")
NO_RACK = Row("no_rack", _SERIOUS,
    "stands in the yard without a rack: no room for one, or it is not along the cells; brace it there")
LORRIES_NOT_FULL = Row("lorries", _NOTE,
    "{loads}, less than {full:.0f} %: {why}")

# Rules that are looser than usual.
NO_WIND = Row("wind", _MINOR, "no wind is considered: rules.wind_speed_m_s is 0")
LITTLE_DRAG = Row("wind", _MINOR,
    "the wind counts for less than on any part with edges: rules.drag_coefficient is {drag:g}")
SLING_ANGLE = Row("sling_angle", _MINOR,
    "two legs of a sling may spread by {angle:.0f} degrees (rules.sling_angle_rad); {most:.0f} degrees are usual at "
    "most")
NO_SWING = Row("swing", _SERIOUS,
    'the swing of loads is not considered (rules.swing = "off"): they may hit something when they swing')
NO_ROPE = Row("rope", _SERIOUS,
    "the hoist rope is not considered (rules.rope = false): it may touch what is above a load")
CONTACT_TOLERANCE = Row("tolerance", _MINOR,
    "parts may be set {tolerance:.0f} mm into each other (rules.contact_tolerance_m); {most:.0f} mm is a usual limit")
SUPPORT_GAP = Row("tolerance", _MINOR,
    "a part counts as carried by what is up to {gap:.0f} mm below it (rules.support_gap_m)")
SMALL_CLEARANCE = Row("small_clearance", _SERIOUS,
    "in transit {kept}: the planner found no way with more; nobody may be below or beside it")
SMALL_ROPE_CLEARANCE = Row("small_clearance", _MINOR, "in transit {kept}: the planner found no way with more")
RAISED_NEAR = Row("small_clearance", _SERIOUS,
    "{what} in the yard {gap} from {other}, not {asked}: the yard has no room with more; nobody may be beside it")
SMALL_DEPARTURE = Row("small_clearance", _SERIOUS,
    "goes straight up from the yard {gap} from {other}, not {asked}: the yard has no room with more; nobody may be "
    "between them")
SMALL_APPROACH = Row("small_clearance", _SERIOUS,
    "is lowered to its place {gap} from {other}, not {asked}: no other last moves keep more; hold it by tag lines, "
    "nobody may be between them")
KEPT_HEADING = Row("kept_heading", _MINOR, "keeps its heading by tag line: it has no room to turn with the jib")
LOW_WIND = Row("low_wind", _MINOR,
    "may be lifted in wind up to {most:.1f} m/s only: {why}; other lifts up to {other:g} m/s")
_LEAST_WIND = "may be lifted in wind up to {most:.1f} m/s only, less than {least:g} m/s: {why}; "
BELOW_LEAST_WIND = Row("low_wind", _SERIOUS,
    _LEAST_WIND + "wait for such a day, lift it with others as one heavier load, or shelter it")
EDGE_ON_WIND = Row("low_wind", _SERIOUS,
    _LEAST_WIND + "in wind up to {least:g} m/s only while it blows at its narrow side, within {sector} degrees, which "
    "two tag lines turn to the wind")
BELOW_LEAST_CLEAR = Row("low_wind", _SERIOUS,
    _LEAST_WIND + "wait for such a day, or give its way more room (rules.transit_clearance_m)")
_TANDEM = (
    "no crane lifts it alone; {first} and {second} together would carry {load} and {other} at its place, {used:.0f} "
    "and {also:.0f} % of their load charts, with their hooks {apart:.1f} m apart: ")
TANDEM = Row("tandem", _MINOR, _TANDEM + "[rules.tandem] in the site file plans such lifts")
TANDEM_TOO_HEAVY = Row("tandem", _MINOR, _TANDEM + "more than the {most:g} % that a lift with two cranes uses at most")
BY_TWO_CRANES = Row("two_cranes", _MINOR,
    "{first} and {second} carry it together: {level:.2f} and {also:.2f} t of it, up to {most:.2f} and {most_also:.2f} "
    "t while it hangs {angle:g} degrees out of level, {used:.0f} and {used_also:.0f} % of their load charts, hooks "
    "{apart:.1f} m apart. One person directs both, no other crane lifts, and one command stops both")
FLIP_LEANS = Row("two_hooks", _MINOR,
    "is turned over between two hooks whose ropes lean by up to {lean:.1f} degrees: ask the crane's maker whether both "
    "hooks may carry one load so, or hold it on a longer beam")
CREW_TIMES = Row("crew_times", _MINOR,
    "{sling:g} s to attach the slings, {brace:g} s to align and brace a part and {release:g} s to take its slings "
    "off are too short for a crew")
CASTING_TIMES = Row("casting_times", _MINOR,
    "{hours:g} hours of work for a cubic metre, {people:g} people at one part and {wait:g} hours until it carries "
    "are not those of concrete ({work})")
COORDINATES = Row("coordinates", _NOTE, "{note}")
NONE_INSIDE = Row("outside", _SERIOUS, "{said}")
OUTSIDE = Row("outside", _NOTE, "{count:,} obstruction{s} outside the site; nothing is planned around {them}")
NOT_CURRENT = Row("not_current", _MINOR,
    "its lift is proven against earlier obstructions only: it was set at {set_at}, before they became the current "
    "ones at {since}")
LATE = Row("late", _MINOR, "{late:,} of {count:,} tasks of the programme end later than it wants: {named}")

# What is assumed.
PLACED_TWICE = Row("placed_twice", _MINOR, "{note}")
PLAN_NOTE = Row("plan_note", _NOTE, "{note}")
PLANNER = Row("planner", _NOTE,
    "{count:,} lifts were planned without the planner or policy that the caller brought; lift {number}: {note}")
ASSUMED_KINDS = Row(ASSUMED_KIND, _NOTE, "{said}")
ASSUMED_MASS = Row("assumed_mass", _NOTE, "{count:,} of {lifted:,} parts have {said}")
ASSUMED_CONTACT = Row("assumed_contact", _NOTE,
    "neighbours may overlap by {tolerance:g} mm, and a part rests on what is up to {gap:g} mm below it")
ASSUMED_GROUND = Row("assumed_ground", _NOTE, "{said}")
TURNED_SITE = Row("assumed_heading", _NOTE, "the site frame is the model turned by {yaw:.2f} degrees")
ASSUMED_RIGGING = Row("assumed_tackle", _NOTE,
    "crane {crane!r}: every part hangs on the same rigging of {mass:g} kg, {high} high, and every lifting point "
    "holds")
ASSUMED_GEAR = Row("assumed_tackle", _NOTE,
    "crane {crane!r}: gear is chosen for each part from a catalogue, whose fittings and lengths are partly assumed; "
    "{points}; the empty hook carries {mass:g} kg of gear, {high} high")
TURNS_WITH_JIB = Row("assumed_heading", _NOTE,
    "a load turns with the jib as if it were fixed to it, and a crew turns it to its final heading above its place; "
    "a load without room for that keeps its heading by tag line")
HEADING_KEPT = Row("assumed_heading", _NOTE, "tag lines keep the heading of a load while the jib turns")
ASSUMED_SWING = Row("assumed_swing", _NOTE,
    "a load swings as a point on its slings, below the hook block as another on its rope, without damping; when it is "
    "set it rests also if rope, slings and mass are {off:.0f} % off; half of the gear swings with either; a hook "
    "block without a stated mass weighs {share:.0f} % of the largest capacity")
ASSUMED_TIMES = Row("assumed_times", _NOTE,
    "each lift ({work}) takes a crew {sling:g} s to sling, {tags}{trial:g} s of trial lift, {brace:g} s to align and "
    "brace, and {release:g} s to take the slings off: nominal values, not measured")
