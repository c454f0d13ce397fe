"""Writer of site files that people can read and edit."""

from __future__ import annotations

import json
from collections.abc import Sequence
from datetime import date
from typing import TYPE_CHECKING

from bimvox.bim.kinds.kind import WAYS, Kind
from bimvox.site.catalogue import FICTITIOUS
from bimvox.site.config.calendar import DEFAULT_BREAKS, DEFAULT_SHIFT, CalendarConfig, CostsConfig
from bimvox.site.config.crane import CraneConfig, OverrideConfig
from bimvox.site.config.project import ProjectConfig, SupportConfig
from bimvox.site.config.rules import CuringConfig, RiggingConfig, YardConfig
from bimvox.site.config.site_config import (
    AreasConfig,
    ComponentConfig,
    KindConfig,
    ModelConfig,
    Polygon,
    SiteConfig,
    ZoneConfig,
)
from bimvox.site.config.validation import Table
from bimvox.site.work import Work
from bimvox.site.yard_guess import access_beside

if TYPE_CHECKING:
    from bimvox.site.kind_rows import KindRow

_HEAD = """\
# Site file of bimvox: parts to be lifted, yard, crane and rules. Units: m, degrees, kg, s (rates: rad/s).
# Coordinates are in the site frame: x and y as in the model (turned by yaw_deg), z = 0 at the top of the ground.
# Only the model's path is required; missing keys are chosen automatically. `bimvox schema site` lists all keys.
"""

_CALENDAR_EXAMPLE = (
    "# [calendar]",
    "# start = 2026-03-09  # first day of work; default: none, so no dates",
    '# days = ["Mon", "Tue", "Wed", "Thu", "Fri"]',
    f'# shifts = ["{DEFAULT_SHIFT}"]',
    f'# breaks = ["{DEFAULT_BREAKS[0]}", "{DEFAULT_BREAKS[1]}"]',
    '# country = "DE"  # its public holidays are free; default: none',
    '# region = "BY"',
    "# holidays = [2026-12-24]  # more free days",
    "# setup_h = 0  # working hours to set up the crane, before the first lift",
    "# unloading_s = 1800  # working time to unload a delivery, before its first lift",
)


def site_toml(
    config: SiteConfig,
    *,
    example_ids: Sequence[str] = (),
    crane_notes: Sequence[str] = (),
    kinds: Sequence[KindRow] = (),
    ground_why: str = "",
) -> str:
    """Return the text of a site file; :func:`bimvox.site.config.file.load_site_config` reads the same values back.

    Args:
        config: Its content, with the model's path as it is to be written.
        example_ids: Ids of components, used in the commented-out examples.
        crane_notes: Lines about the choice of the crane, written as comments.
        kinds: What the parts are, by type; each a comment to correct.
        ground_why: What the height of the ground was taken from, written as a comment.
    """
    sections = [
        _HEAD + (f"\nname = {_value(config.name)}\n" if config.name else ""),
        config.coordinates != "site" and _lines(_key("coordinates", config.coordinates, "[easting, northing]")),
        _project(config.project),
        _model(config, kinds, ground_why),
        _grid(config),
        _areas(config.areas, [crane.base_m for crane in config.cranes if crane.base_m is not None]),
        *(_crane(crane, crane_notes, several=len(config.cranes) > 1) for crane in config.cranes),
        _rigging(config),
        _components(config.component, example_ids),
        _zones(config.zone, config.areas.yard),
        _sequence(config, example_ids),
        _means(config),
        _rules(config),
        _yard(config.yard),
        _calendar(config.calendar),
        _costs(config.costs),
        _policy(config),
        *(_support(one) for one in config.support),
    ]
    return "\n".join(section for section in sections if section)


def _project(project: ProjectConfig | None) -> str:
    if project is None:
        return _lines(
            "# The title block of the lift plan (bimvox report). It changes nothing in the plan.",
            "# [project]",
            '# number = "2026-014"  # also name, address, client, contractor, revision',
            '# prepared_by = "A. Person"  # also checked_by, approved_by and the people on the site',
        )
    given = {key: getattr(project, key) for key in type(project).model_fields}
    return _lines("[project]", *(_key(key, value) for key, value in given.items() if value))


def _model(config: SiteConfig, kinds: Sequence[KindRow], ground_why: str) -> str:
    model = config.model
    return _lines(
        "[model]",
        _key("path", model.path.as_posix(), "IFC or mesh file, relative to this file's folder"),
        _key("select", model.select, "parts to be lifted")
        or '# select = "IfcColumn, IfcBeam, IfcSlab"  # parts to be lifted; default: all prefabricated classes\n'
        '#   (an IfcOpenShell query; for a mesh the names of bodies: "column*, beam*")',
        _key("unit", model.unit, "of the mesh file"),
        _key("up", model.up, "axis of the mesh file that points up"),
        _key("voxel_size_m", model.voxel_size_m, "edge length of a planning cell"),
        _key("yaw_deg", model.yaw_deg, "angle of the site's x axis in the model, counter-clockwise"),
        _key(
            "ground_m",
            model.ground_m,
            "height in the model that is the top of the ground" + (ground_why and f": {ground_why}"),
        ),
        _key("assemblies", model.assemblies, 'lift assemblies "whole" or as "parts"'),
        *_kinds(model.kinds, kinds),
    )


_KINDS_NOTE = f"""\
# What the parts are and how each gets to its place, by type, as bimvox sees it; the doubtful ones first. To correct a
# line, remove its first # and change the values. It wins over the model; nothing else has to be done again.
# kind: {", ".join(Kind)}
# means: {", ".join(WAYS)} (not in the plan); without it, kind, size and mass decide
# For a spreadsheet: bimvox inspect MODEL --csv kinds.csv, then kinds = ["kinds.csv"]."""
_MOST_KINDS = 60


def _kinds(given: Sequence[KindConfig | str], rows: Sequence[KindRow]) -> Sequence[str]:
    """Return the corrections, and what could be corrected as comments."""
    if not (given or rows):
        return ()
    lines = [f"  {_value(one)}," for one in given]
    lines += [f"  # {line}" for line in map(_kind_line, rows[:_MOST_KINDS])]
    if len(rows) > _MOST_KINDS:
        lines.append(f"  # ... and {len(rows) - _MOST_KINDS:,} more: bimvox inspect MODEL --csv FILE lists all")
    return (*([_KINDS_NOTE] if rows else []), "kinds = [", *lines, "]")


def _kind_line(row: KindRow) -> str:
    """Return the line that confirms what is assumed of a type, with what is known as its comment."""
    kind = Kind.CONCRETE if row.kind is Kind.OTHER and row.means in ("crane", "in_situ") else row.kind
    values = [f"select = {_literal(row.select)}", f"kind = {_value(kind.value)}"]
    if row.means in WAYS:
        values.append(f"means = {_value(row.means)}")
    masses_t = [f"{kg / 1000.0:.2g}" if kg < 995.0 else f"{kg / 1000.0:.1f}" for kg in row.mass_kg or ()]
    mass = f", {' to '.join(dict.fromkeys(masses_t))} t" if masses_t else ""
    unsure = "ASSUMED, " if row.is_kind_assumed else "WAY ASSUMED, " if row.is_way_assumed else ""
    others = f" (the line selects {row.selects - row.count:,} more)" if row.selects > row.count else ""
    said = f"{unsure}{row.count:,} part{'s' * (row.count != 1)}{others}{mass}: {row.why}"
    return f"{{ {', '.join(values)} }},  # {_one_line(said)}"


def precast_line(model: ModelConfig, rows: Sequence[KindRow]) -> str:
    """Return a site file in one line that lifts concrete of unknown make as precast; empty if there is none."""
    wanted = [row for row in rows if row.means == "crane" and row.kind in (Kind.CONCRETE, Kind.OTHER)]
    kinds = (f"{{ select = {_literal(row.select)}, kind = {_value(Kind.PRECAST.value)} }}" for row in wanted)
    given = model.model_dump(mode="json", exclude_defaults=True, exclude_none=True, exclude={"kinds"})
    given["path"] = model.path.as_posix()
    said = ", ".join(f"{key} = {_value(value)}" for key, value in given.items())
    return f"model = {{ {said}, kinds = [{', '.join(kinds)}] }}" if wanted else ""


def _literal(text: str) -> str:
    """Return a text as TOML, without escapes if possible: queries are full of quotes and backslashes."""
    return f"'{text}'" if text.isprintable() and "'" not in text else _value(text)


def _one_line(text: str) -> str:
    return "".join(letter if letter.isprintable() else " " for letter in text)


def _grid(config: SiteConfig) -> str:
    note = "# Extent of the site. Default: building, areas and crane, with a margin."
    if config.grid is None:
        return _lines(note, "# [grid]", "# low_m = [0, 0]", "# high_m = [40, 30, 20]")
    return _lines(note, "[grid]", _key("low_m", config.grid.low_m), _key("high_m", config.grid.high_m))


def _areas(areas: AreasConfig, masts_m: Sequence[Sequence[float]]) -> str:
    return _lines(
        "# Areas on the ground, as polygons of [x, y] corners.",
        "[areas]",
        _key("construction", areas.construction),
        areas.yard and "# The yard: one or more polygons within the crane's reach. Parts come in truckloads.",
        _key("yard", areas.yard),
        *_access(areas, masts_m),
        _key("plot", areas.plot, "ground that the jib may sweep over"),
    )


def _access(areas: AreasConfig, masts_m: Sequence[Sequence[float]]) -> Sequence[str | None]:
    """Return the access of trucks; as a comment next to the yard if it is not planned."""
    if areas.access is not None:
        return (_key("access", areas.access),)
    if areas.yard is None or areas.construction is None:
        return ()
    beside = access_beside(areas.yard, areas.construction, masts_m)
    return (f"# access = [{_value(beside)}]  # trucks stand here, parts do not; the crane unloads them",)


def _crane(crane: CraneConfig, notes: Sequence[str], *, several: bool) -> str:
    if crane.kind == "none":
        return _lines("[crane]", 'kind = "none"  # no crane: no rope, no reach, no load chart')
    lines: list[object] = [
        *(f"# {note}" for note in notes),
        "[[crane]]" if several else "[crane]",
        _key("kind", crane.kind, 'or "none"'),
        (crane.name or "").startswith(FICTITIOUS) and "# FICTITIOUS: this machine does not exist. Name a real one.",
        _key("name", crane.name),
        _key("machine", crane.machine, "of the catalogue, or a file next to this one"),
        _key("base_m", crane.base_m, "foot of the slewing axis"),
        _key("jib_height_m", crane.jib_height_m, "height of the rope exit above z = 0"),
        _key("jib_length_m", crane.jib_length_m, "largest hook radius: one of the machine's jib lengths"),
        _key("sling_m", crane.sling_m, "height of the slings, from the load's top to the hook"),
        _key("rigging_mass_kg", crane.rigging_mass_kg, "slings and spreader, added to every load"),
        _key("falls", crane.falls, "parts of rope that carry the hook, for the whole job"),
        _key("working_range", crane.working_range, "limiters"),
        *_machine_keys(crane),
    ]
    if crane.override is not None:
        lines += ["# What differs from the machine, on purpose; every output lists it.", "[crane.override]"]
        lines += _machine_keys(crane.override)
    return _lines(*lines)


def _machine_keys(crane: OverrideConfig) -> list[object]:
    """Return the lines of the keys that belong to a machine."""
    own = not isinstance(crane, CraneConfig)
    lines: list[object] = [
        own and _key("jib_length_m", crane.jib_length_m, "largest hook radius"),
        _key("min_radius_m", crane.min_radius_m, "smallest hook radius"),
        _key("mast_size_m", crane.mast_size_m, "edge of the square mast"),
        _key("hook_block_kg", crane.hook_block_kg, "hook block, added to every load"),
        _key("max_wind_m_s", crane.max_wind_m_s, "wind (gust) up to which it works"),
        *(_key(name, getattr(crane, name)) for name in ("slewing", "trolley", "hoist")),
        crane.jib and "# Luffing jib; radii, height and limits of the hook follow from it.",
        _key("jib", crane.jib),
        crane.gears and _key("gears", crane.gears, "[largest mass on the rope in kg, m/s]"),
    ]
    if crane.reeving:
        lines += ["# Per reeving: load chart, hook block and rates; `falls` selects the reeving."]
        lines += ["reeving = [", *(f"  {_value(reeving)}," for reeving in crane.reeving), "]"]
    if crane.chart:
        lines += ["# Load chart: [radius in m, capacity in kg], load and rigging together.", "chart = ["]
        lines += [f"  {_value(pair)}," for pair in crane.chart] + ["]"]
    return lines


def _rigging(config: SiteConfig) -> str:
    given, nothing = config.rigging, RiggingConfig()
    if given != nothing:
        values = {key: getattr(given, key) for key in type(given).model_fields}
        return _lines("[rigging]", *(_key(key, value) for key, value in values.items() if value))
    if not any(one.machine is not None and one.sling_m is None for one in config.cranes):
        return ""
    return _lines(
        "# Slings, spreaders and shackles are chosen for each part, unless [crane] has sling_m and rigging_mass_kg.",
        "# [rigging]",
        '# gear = ["my-slings.toml"]  # your own, next to this file; `bimvox schema gear` lists the keys',
        f"# spreader_from_m = {nothing.spreader_from_m:g}  # lifting points further apart hang on a spreader",
    )


def _components(entries: Sequence[ComponentConfig], example_ids: Sequence[str]) -> str:
    first, second = (*example_ids, "1a2B3c4D5e6F7g8H9i0JkL", "0L1k2J3i4H5g6F7e8D9c0B")[:2]
    lines: list[object] = ["# Settings of a part that differ from the defaults, one table per part."]
    if not entries:
        lines += [
            "# [[component]]",
            f"# global_id = {_value(first)}",
            "# start = [12.0, -8.0]   # lowest corner of the part as stored in the yard; default: planned",
            '# pose = "as_built"      # or "lying_x", "lying_y": stored lying and upended before the lift',
            f"# after = {_value([second])}  # set later than these parts; `before`: set earlier",
            "# turn = 1               # stored with a quarter turn, counter-clockwise; turned back while it hangs",
            '# means = "in_situ"       # cast in place; "built" by its trade; "by_hand"; "crane": lifted in any case',
            "# pinned = true          # it already exists (only without the keys above)",
        ]
    for entry in entries:
        lines += ["[[component]]", _key("global_id", entry.global_id)]
        lines += [_key(name, getattr(entry, name)) for name in ("start", "pose", "turn")]
        lines += [
            getattr(entry, name) and _key(name, getattr(entry, name))
            for name in ("before", "after", "crane", "kind", "means", "why")
        ]
        lines += [entry.pinned and _key("pinned", True, "it already exists: cast in situ, or built before")]
    return _lines(*lines)


def _zones(zones: Sequence[ZoneConfig], yards: Sequence[Polygon] | None) -> str:
    lines: list[object] = [
        '# Zones (EN 17076): "prohibited" (no hook above), "no_load" (no load above), "public" (neither), "slow"',
        '# (reduced rates), "limiter" (lowest_hook_m, highest_hook_m). Or "assembly": parts are set zone by zone.',
    ]
    if not zones:
        x, y = yards[0][0] if yards else (0.0, 0.0)
        example = ((x - 10, y - 10), (x - 5, y - 10), (x - 5, y - 5))
        lines += ["# [[zone]]", '# kind = "prohibited"', f"# polygon = {_value(example)}"]
    for zone in zones:
        lines += [
            "[[zone]]",
            *(_key(name, getattr(zone, name)) for name in ("kind", "name", "polygon")),
            _key("share", zone.share, "share of the axes' highest rates"),
            *(_key(name, getattr(zone, name)) for name in ("lowest_hook_m", "highest_hook_m")),
        ]
    lines += [
        "",
        "# Temporary obstructions go into a separate file (plan --obstructions FILE, or watch FILE):",
        '#   {"version": 1, "obstructions": [{"id": "truck", "box": {"min": [2, 11, 0], "max": [4.5, 19, 3.2]}}]}',
    ]
    return _lines(*lines)


_RULES = {
    "clearance_m": "distance to obstructions and the mast, rounded up to whole cells",
    "transit_clearance_m": "distance of a part in transit to everything",
    "rope_clearance_m": "distance on plan of hook and rope to higher objects",
    "contact_tolerance_m": "how deep neighbours may overlap when a part is set",
    "support_gap_m": "how far below a part its support may be",
    "rope": "keep the hoist rope above the load free",
    "sample_period_s": "sampling interval of the motion in the log",
    "turn_s": "time to turn a hanging part by a quarter",
    "heading": 'kept by tag line, or "with_jib": loads turn with it, without tag lines, where there is room',
    "swing": '"off": the swing of loads is ignored',
    "truckload_kg": "largest mass of a delivery; 0: as much as the yard holds",
    "wind_speed_m_s": "gust in which lifts must be possible; 0: no wind",
    "drag_coefficient": "of the parts: from 1.1 (cube) to 2.0 (long plate)",
    "sling_angle_deg": "largest angle between two legs of a sling",
    "critical_share": "share of the capacity above which a lift is critical",
    "highest_utilisation": "highest permitted share of the capacity; a lift that needs more is refused",
    "crane_separation_m": "distance between cranes, also while they brake",
    "by_other_means": "a part that the crane cannot set counts as set by other means; false: it is missing",
}

_IF_WRITTEN = {
    "transit_clearance_m": ". So by default, as far as a lift can",
    "rope_clearance_m": ". The same",
    "wind_speed_m_s": ". By default parts that permit less wait for less",
}
"""What the comment adds for a rule whose default gives way; a value without # is kept by every lift."""

_MEANS = {
    "heaviest_kg": "heavier concrete is cast in place, if it is not stated to be precast",
    "longest_m": "the same for its longest side",
    "widest_m": "for its second side",
    "highest_m": "for its shortest side",
    "lift_from_kg": "lighter parts are set by hand, in bundles",
}


_FOR_ALL = {
    "bracing_s": (120, "one brace_s for all classes of work, instead of those below"),
    "release_s": (30, "one release_s for all classes of work"),
}


def _rules(config: SiteConfig) -> str:
    rules = config.rules
    left_out = {"crane_separation_m"} if len(config.cranes) <= 1 else set()
    left_out |= {"highest_utilisation"} if rules.highest_utilisation == 1.0 else set()
    shown = [key for key in _RULES if key not in left_out]
    return _lines(
        "[rules]",
        "# A default behind # may give way: a lift that cannot keep it keeps what it can. Without #, every lift must.",
        *(_key(key, getattr(rules, key), _RULES[key]) or _default(config, key) for key in shown),
        *(_key(key, getattr(rules, key)) or f"# {key} = {n}  # {said}" for key, (n, said) in _FOR_ALL.items()),
        "",
        "# The crew's times by class of work, in seconds, while the crane stands: to attach the slings; to align, fix",
        "# and brace the part; to take the slings off; to fix the tag lines, and again to take them off. Typical of",
        "# the field, not measured; sources: docs/formats.md.",
        "[rules.times]",
        *(_key(work, getattr(rules.times, work)) for work in type(rules.times).model_fields),
        "",
        "# Work that the crane does not do: it begins when all earlier parts are set and what it rests on carries.",
        "# The crane goes on with what does not rest on it, then it pauses. Work before the first lift is done when",
        "# the clock starts. hours_m3: working hours of one person for a cubic metre; wait_h: hours until it carries",
        "# what rests on it. Typical of the field, not measured; sources: docs/formats.md.",
        "[rules.casting]",
        _key("people", rules.casting.people, "who cast, one part after the other"),
        _key("hand_s", rules.casting.hand_s, "to set a part by hand"),
        _key("bundle_kg", rules.casting.bundle_kg, "heavier bundles of such parts are material lifts of the crane"),
        _key("bundle_s", rules.casting.bundle_s, "crane time of a material lift; it has no path"),
        *(_key(work.value, getattr(rules.casting, work.value)) for work in Work),
        "# What its trade builds in place, of pieces (masonry, partitions, glazing, earth), and then is in the way:",
        "# working hours of one person for a cubic or a square metre; wait_h as above.",
        "[rules.building]",
        *(_key(name, value) for name, value in rules.building.model_dump().items()),
        *_curing(rules.curing),
    )


def _curing(curing: CuringConfig | None) -> tuple[str | None, ...]:
    if curing is None:
        return ()
    title = ("", "# Hours until the joints of lifted parts carry what rests on these.", "[rules.curing]")
    return (*title, *(_key(key, getattr(curing, key)) for key in type(curing).model_fields))


_YARD = {
    "gap_m": "free around a part when it is picked, for the slinger",
    "stack_parts": "most parts in a stack; 1: no stacks",
    "stack_height_m": "largest height of a stack: slings are attached from the ground",
    "stack_kg": "largest mass of a stack; the ground decides",
    "dunnage_m": "between two parts of a stack or rack",
    "rack_parts": "most walls in a rack; 0: no racks",
    "rack_depth": "depth of its frame behind the last wall, share of the wall's height",
    "truck_length_m": "that parts may take on a truck; a larger part comes by a special transport",
    "truck_width_m": "the same",
    "truck_height_m": "the same, above the bed",
}


def _yard(yard: YardConfig | None) -> str:
    note = "# How parts lie in the yard: flat ones in stacks, the one that is lifted first on top."
    if yard is None:
        lines = (f"# {_key(key, getattr(YardConfig(), key), said)}" for key, said in _YARD.items())
        return _lines(note, "# Without this table: a cell apart, and never on each other.", "# [yard]", *lines)
    return _lines(note, "[yard]", *(_key(key, getattr(yard, key), said) for key, said in _YARD.items()))


def _default(config: SiteConfig, key: str) -> str:
    """Return the line of a rule that the file leaves to its default."""
    return f"# {_key(key, getattr(config.rules_in_force, key), _RULES[key])}{_IF_WRITTEN[key]}"


def _means(config: SiteConfig) -> str:
    note = "# What is lifted, and what is cast in place or set by hand ([[component]] means decides for one part)."
    return _lines(note, "[means]", *(_key(key, getattr(config.means, key), _MEANS[key]) for key in _MEANS))


def _sequence(config: SiteConfig, example_ids: Sequence[str]) -> str:
    sequence = config.sequence
    example = _value((*example_ids, "1a2B3c4D5e6F7g8H9i0JkL")[0])
    return _lines(
        '# Wishes about the order; geometry takes precedence. Zones of kind "assembly" are finished one by one.',
        "[sequence]",
        _key("first", sequence.first)
        if sequence.first
        else f"# first = [{example}]  # set before all others, with the parts that they need",
        _key("search", sequence.search, "search a faster order than the greedy one"),
        _key("storeys", sequence.storeys, "finish a storey before the next one, as far as geometry permits"),
        _key("ranks", sequence.ranks, "order of the classes within a storey"),
        _key("schedule", sequence.schedule, "keep the order of the tasks in the building file, if it has any"),
        _key("programme", sequence.programme, "its tasks take the place of those in the building file"),
    )


def _calendar(calendar: CalendarConfig) -> str:
    note = "# Working hours. With a start, every output has dates; missing keys have the values shown here."
    if calendar == CalendarConfig():
        return _lines(note, *_CALENDAR_EXAMPLE)
    keys = (key for key in CalendarConfig.model_fields if getattr(calendar, key) not in (None, ()))
    breaks = ["breaks = []"] if calendar.breaks == () else []
    return _lines(note, "[calendar]", *(_key(key, getattr(calendar, key)) for key in keys), *breaks)


def _costs(costs: CostsConfig) -> str:
    if costs == CostsConfig():
        return ""
    title = ("# What cranes and crew cost, to compare set-ups.", "[costs]")
    return _lines(
        *title, *(_key(key, value) for key in CostsConfig.model_fields if (value := getattr(costs, key)) != ())
    )


def _support(support: SupportConfig) -> str:
    return _lines("[[support]]", *(_key(key, getattr(support, key)) for key in SupportConfig.model_fields))


def _policy(config: SiteConfig) -> str:
    policy = config.policy
    return _lines(
        "[policy]",
        _key("id", policy.id) or '# id = "..."  # a policy in the store; default: the one trained for this site',
        _key("steps", policy.steps) or "# steps = 200000  # training budget in environment steps",
        _key("seed", policy.seed),
        _key("required_success", policy.required_success, "share of test episodes that must succeed"),
    )


def _lines(*lines: object) -> str:
    """Return the lines joined, without absent ones."""
    return "".join(f"{line}\n" for line in lines if line or line == "")


def _key(key: str, value: object, comment: str = "") -> str | None:
    """Return the line of a key; None if its value is None."""
    return None if value is None else f"{key} = {_value(value)}" + (f"  # {comment}" if comment else "")


def _value(value: object) -> str:
    """Return a value as TOML, tables inline; a number is the shortest text that reads back the same value."""
    if isinstance(value, str):
        # A JSON string is a TOML basic string, except for the character DEL.
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007F")
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | float):
        return str(int(value)) if float(value).is_integer() and abs(value) < 1e15 else repr(float(value))
    if isinstance(value, date):
        return value.isoformat()
    if isinstance(value, Table):
        keys = sorted(type(value).model_fields, key=lambda key: key == "chart")  # the longest one last
        return f"{{ {', '.join(line for key in keys if (line := _key(key, getattr(value, key))))} }}"
    assert isinstance(value, Sequence)
    return f"[{', '.join(map(_value, value))}]"
