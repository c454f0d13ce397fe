"""Writer of site files that people can read and edit."""

from __future__ import annotations

import json
from collections.abc import Sequence

from bimvox.site.config import (
    AreasConfig,
    ComponentConfig,
    CraneConfig,
    LuffingConfig,
    Polygon,
    ReevingConfig,
    SiteConfig,
    ZoneConfig,
)
from bimvox.site.crane_guess import LARGER

_HEAD = """\
# Site file of bimvox: parts to be lifted, yard, crane and rules. Units: metres, radians, kilograms, seconds.
# Coordinates are in the site frame: x and y as in the model (turned by yaw_rad), z = 0 at the top of the ground.
# Only the model's path is required; missing keys are chosen automatically. `bimvox schema site` lists all keys.
"""


def site_toml(config: SiteConfig, *, example_ids: Sequence[str] = ()) -> str:
    """Return the text of a site file; :func:`bimvox.site.config_file.load_site_config` reads the same values back.

    Args:
        config: Its content, with the model's path as it is to be written.
        example_ids: Ids of components, used in the commented-out examples.
    """
    sections = [
        _HEAD + (f"\nname = {_text(config.name)}\n" if config.name else ""),
        _model(config),
        _grid(config),
        _areas(config.areas),
        *(_crane(crane, several=len(config.cranes) > 1) for crane in config.cranes),
        _components(config.component, example_ids),
        _zones(config.zone, config.areas.yard),
        _sequence(config, example_ids),
        _rules(config),
        _policy(config),
    ]
    return "\n".join(section for section in sections if section)


def _model(config: SiteConfig) -> str:
    model = config.model
    select = (
        f"select = {_text(model.select)}  # parts to be lifted"
        if model.select
        else '# select = "IfcColumn, IfcBeam, IfcSlab"  # parts to be lifted; default: all prefabricated classes\n'
        '#   (an IfcOpenShell query; for a mesh the names of bodies: "column*, beam*")'
    )
    return _lines(
        "[model]",
        f"path = {_text(model.path.as_posix())}  # IFC or mesh file, relative to this file's folder",
        select,
        model.unit and f"unit = {_text(model.unit)}  # of the mesh file",
        model.up and f"up = {_text(model.up)}  # axis of the mesh file that points up",
        _maybe("voxel_size_m", model.voxel_size_m, "edge length of a planning cell"),
        f"yaw_rad = {_number(model.yaw_rad)}  # angle of the site's x axis in the model, counter-clockwise",
        _maybe("ground_m", model.ground_m, "height in the model that is the top of the ground"),
        f'assemblies = {_text(model.assemblies)}  # lift assemblies "whole" or as "parts"',
    )


def _grid(config: SiteConfig) -> str:
    note = "# Extent of the site. Default: building, areas and crane, with a margin."
    if config.grid is None:
        return _lines(note, "# [grid]", "# low_m = [0, 0]", "# high_m = [40, 30, 20]")
    return _lines(note, "[grid]", f"low_m = {_numbers(config.grid.low_m)}", f"high_m = {_numbers(config.grid.high_m)}")


def _areas(areas: AreasConfig) -> str:
    yards = areas.yard or ()
    return _lines(
        "# Areas on the ground, as polygons of [x, y] corners.",
        "[areas]",
        areas.construction and f"construction = {_polygon(areas.construction)}",
        yards and "# The yard: one or more polygons within the crane's reach. Parts come in truckloads.",
        yards and f"yard = [{', '.join(_polygon(yard) for yard in yards)}]",
    )


def _crane(crane: CraneConfig, *, several: bool) -> str:
    if crane.kind == "none":
        return _lines("[crane]", 'kind = "none"  # no crane: no rope, no reach, no load chart')
    lines: list[object] = ["[[crane]]" if several else "[crane]", f'kind = {_text(crane.kind)}  # or "none"']
    if crane.name:
        lines += [
            LARGER in crane.name and "# Larger than the built-in machines, which cannot serve this site: check it.",
            f"name = {_text(crane.name)}",
            crane.machine and f"machine = {_text(crane.machine)}  # built-in machine",
        ]
    lines += [
        crane.base_m and f"base_m = {_numbers(crane.base_m)}  # foot of the slewing axis",
        _maybe("jib_height_m", crane.jib_height_m, "height of the rope exit above z = 0"),
        _maybe("jib_length_m", crane.jib_length_m, "largest hook radius"),
        _maybe("min_radius_m", crane.min_radius_m, "smallest hook radius"),
        _maybe("mast_size_m", crane.mast_size_m, "edge of the square mast"),
        _maybe("sling_m", crane.sling_m, "height of the slings, from the load's top to the hook"),
        _maybe("rigging_mass_kg", crane.rigging_mass_kg, "slings and spreader, added to every load"),
        _maybe("hook_block_kg", crane.hook_block_kg, "hook block, added to every load"),
        _maybe("falls", crane.falls, "parts of rope that carry the hook, for the whole job"),
        _maybe("max_wind_m_s", crane.max_wind_m_s, "wind (gust) up to which it works"),
    ]
    for key, axis in (("slewing", crane.slewing), ("trolley", crane.trolley), ("hoist", crane.hoist)):
        if axis is not None:
            inside = ", ".join(f"{name} = {_number(value)}" for name, value in axis.model_dump().items())
            lines.append(f"{key} = {{ {inside} }}")
    if crane.jib:
        lines += _jib(crane.jib)
    if crane.working_range:
        ranges = crane.working_range
        limits = [
            ranges.slew_rad and f"slew_rad = {_numbers(ranges.slew_rad)}",
            ranges.radius_m and f"radius_m = {_numbers(ranges.radius_m)}",
            ranges.highest_hook_m and f"highest_hook_m = {_number(ranges.highest_hook_m)}",
        ]
        lines.append(f"working_range = {{ {', '.join(entry for entry in limits if entry)} }}  # limiters")
    if crane.gears:
        lines.append(f"gears = [{', '.join(map(_numbers, crane.gears))}]  # [largest mass on the rope in kg, m/s]")
    if crane.reeving:
        lines += ["# Per reeving: load chart, hook block and rates; `falls` selects the reeving."]
        lines += ["reeving = [", *(f"  {_reeving(reeving)}," for reeving in crane.reeving), "]"]
    if crane.chart:
        lines += ["# Load chart: [radius in m, capacity in kg], load and rigging together.", "chart = ["]
        lines += [f"  {_numbers(pair)}," for pair in crane.chart] + ["]"]
    return _lines(*lines)


def _jib(jib: LuffingConfig) -> list[object]:
    """Return the lines of the luffing jib, one inline table."""
    entries: list[object] = []
    for name, value in jib.model_dump(exclude_none=True).items():
        if isinstance(value, dict):
            inside = ", ".join(f"{key} = {_number(limit)}" for key, limit in value.items())
            entries.append(f"{name} = {{ {inside} }}")
        else:
            entries.append(f"{name} = {_numbers(value) if isinstance(value, tuple) else _number(value)}")
    return [
        "# Luffing jib; radii, height and limits of the hook follow from it.",
        f"jib = {{ {', '.join(map(str, entries))} }}",
    ]


def _reeving(reeving: ReevingConfig) -> str:
    """Return a reeving as an inline table, on one line as TOML requires."""
    entries = [
        f"falls = {reeving.falls}",
        f"hook_block_kg = {_number(reeving.hook_block_kg)}",
        reeving.trolley_rate_m_s and f"trolley_rate_m_s = {_number(reeving.trolley_rate_m_s)}",
        f"gears = [{', '.join(map(_numbers, reeving.gears))}]",
        f"chart = [{', '.join(map(_numbers, reeving.chart))}]",
    ]
    return f"{{ {', '.join(entry for entry in entries if entry)} }}"


def _components(entries: Sequence[ComponentConfig], example_ids: Sequence[str]) -> str:
    first, second = (*example_ids, "1a2B3c4D5e6F7g8H9i0JkL", "0L1k2J3i4H5g6F7e8D9c0B")[:2]
    lines: list[object] = ["# Settings of a part that differ from the defaults, one table per part."]
    if not entries:
        lines += [
            "# [[component]]",
            f"# global_id = {_text(first)}",
            "# start = [12.0, -8.0]   # lowest corner of the part as stored in the yard; default: planned",
            '# pose = "as_built"      # or "lying_x", "lying_y": stored lying and upended before the lift',
            f"# after = [{_text(second)}]  # set later than these parts; `before`: set earlier",
            "# turn = 1               # stored with a quarter turn, counter-clockwise; turned back while it hangs",
            "# pinned = true          # it already exists (only without the keys above)",
        ]
    for entry in entries:
        lines += [
            "[[component]]",
            f"global_id = {_text(entry.global_id)}",
            entry.start and f"start = {_numbers(entry.start)}",
            entry.pose and f"pose = {_text(entry.pose.value)}",
            entry.turn is not None and f"turn = {entry.turn}",
            entry.before and f"before = [{', '.join(map(_text, entry.before))}]",
            entry.after and f"after = [{', '.join(map(_text, entry.after))}]",
            entry.crane and f"crane = {_text(entry.crane)}",
            entry.pinned and "pinned = true  # it already exists: cast in situ, or built before",
        ]
    return _lines(*lines)


def _zones(zones: Sequence[ZoneConfig], yards: Sequence[Polygon] | None) -> str:
    lines: list[object] = [
        '# Zones (EN 17076): "prohibited" (no hook above), "no_load" (no load above), "public" (neither), "slow"',
        '# (reduced rates), "limiter" (lowest_hook_m, highest_hook_m). Or "assembly": parts are set zone by zone.',
    ]
    if not zones:
        x, y = yards[0][0] if yards else (0.0, 0.0)
        example = ((x - 10, y - 10), (x - 5, y - 10), (x - 5, y - 5))
        lines += ["# [[zone]]", '# kind = "prohibited"', f"# polygon = {_polygon(example)}"]
    for zone in zones:
        lines += [
            "[[zone]]",
            f"kind = {_text(zone.kind)}",
            zone.name and f"name = {_text(zone.name)}",
            f"polygon = {_polygon(zone.polygon)}",
            zone.share is not None and f"share = {_number(zone.share)}  # share of the axes' highest rates",
            zone.lowest_hook_m is not None and f"lowest_hook_m = {_number(zone.lowest_hook_m)}",
            zone.highest_hook_m is not None and f"highest_hook_m = {_number(zone.highest_hook_m)}",
        ]
    lines += [
        "",
        "# Temporary obstructions go into a separate file (plan --obstructions FILE, or watch FILE):",
        '#   {"version": 1, "obstructions": [{"id": "truck", "box": {"min": [2, 11, 0], "max": [4.5, 19, 3.2]}}]}',
    ]
    return _lines(*lines)


def _rules(config: SiteConfig) -> str:
    rules = config.rules
    return _lines(
        "[rules]",
        _maybe("clearance_m", rules.clearance_m, "distance to obstructions and the mast, rounded up to whole cells"),
        _maybe("transit_clearance_m", rules.transit_clearance_m, "distance of a part in transit to everything"),
        _maybe("rope_clearance_m", rules.rope_clearance_m, "distance on plan of hook and rope to higher objects"),
        _maybe("contact_tolerance_m", rules.contact_tolerance_m, "how deep neighbours may overlap when a part is set"),
        _maybe("support_gap_m", rules.support_gap_m, "how far below a part its support may be"),
        f"rope = {_flag(rules.rope)}  # keep the hoist rope above the load free",
        _maybe("sample_period_s", rules.sample_period_s, "sampling interval of the motion in the log"),
        _maybe("bracing_s", rules.bracing_s, "time to align, fix and brace a part on the hook"),
        _maybe("release_s", rules.release_s, "time to remove the slings"),
        _maybe("turn_s", rules.turn_s, "time to turn a hanging part by a quarter"),
        f'swing = {_text(rules.swing)}  # "off": the swing of loads is ignored',
        _maybe("truckload_kg", rules.truckload_kg, "largest mass of a delivery; 0: as much as the yard holds"),
        _maybe("wind_speed_m_s", rules.wind_speed_m_s, "gust in which every lift must be possible; 0: no wind"),
        _maybe("drag_coefficient", rules.drag_coefficient, "of the parts: from 1.1 (cube) to 2.0 (long plate)"),
        _maybe("sling_angle_rad", rules.sling_angle_rad, "largest angle between two legs of a sling"),
        _maybe("critical_share", rules.critical_share, "share of the capacity above which a lift is critical"),
        len(config.cranes) > 1
        and _maybe("crane_separation_m", rules.crane_separation_m, "distance between cranes, also while they brake"),
    )


def _sequence(config: SiteConfig, example_ids: Sequence[str]) -> str:
    sequence = config.sequence
    example = _text((*example_ids, "1a2B3c4D5e6F7g8H9i0JkL")[0])
    return _lines(
        '# Wishes about the order; geometry takes precedence. Zones of kind "assembly" are finished one by one.',
        "[sequence]",
        f"first = [{', '.join(map(_text, sequence.first))}]"
        if sequence.first
        else f"# first = [{example}]  # set before all others, with the parts that they need",
        f"storeys = {_flag(sequence.storeys)}  # finish a storey before the next one, as far as geometry permits",
        f"schedule = {_flag(sequence.schedule)}  # keep the order of the tasks in the building file, if it has any",
    )


def _policy(config: SiteConfig) -> str:
    policy = config.policy
    return _lines(
        "[policy]",
        f"id = {_text(policy.id)}"
        if policy.id
        else '# id = "..."  # a policy in the store; default: the one trained for this site',
        f"steps = {policy.steps}" if policy.steps else "# steps = 200000  # training budget in environment steps",
        f"seed = {policy.seed}",
        _maybe("required_success", policy.required_success, "share of test episodes that must succeed"),
    )


def _lines(*lines: object) -> str:
    """Return the lines joined, without absent ones."""
    return "".join(f"{line}\n" for line in lines if line or line == "")


def _maybe(key: str, value: float | None, comment: str) -> str | None:
    return None if value is None else f"{key} = {_number(value)}  # {comment}"


def _text(value: str) -> str:
    # A JSON string is a TOML basic string, except for the character DEL.
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007F")


def _number(value: float) -> str:
    """Return the shortest text that reads back the same value; whole numbers without a fraction."""
    return str(int(value)) if float(value).is_integer() and abs(value) < 1e15 else repr(float(value))


def _numbers(values: Sequence[float]) -> str:
    return f"[{', '.join(_number(value) for value in values)}]"


def _polygon(corners: Sequence[Sequence[float]]) -> str:
    return f"[{', '.join(_numbers(corner) for corner in corners)}]"


def _flag(value: bool) -> str:
    return "true" if value else "false"
