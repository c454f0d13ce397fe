"""Numbers and names as the report writes them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from bimvox.site.site import part_name

METHODS = {
    "greedy": "towards the target",
    "policy": "policy",
    "retrained": "policy, retrained",
    "search": "search (A*)",
}
SWING = {
    "shaped": "moves are shaped so that loads are at rest when set; the swing in transit is proven clear",
    "off": "NOT CHECKED: loads may still swing when set, and may hit something in transit",
}
CHECKS = {
    "complete": "every part has exactly one lift, numbered without gaps; infeasible lifts have a reason",
    "shapes": "a part's cells cover all of its triangles, and its mesh fills them",
    "mass": "a part's mass is that of a material of its volume",
    "rigging": "no piece of gear carries more than its working load limit at its angle; mass and height of the gear",
    "slings": "lifting points are on the part, and the hook is high enough for the slings' angle",
    "unit_moves": "every path goes from the part's place in the yard to its place in the building, one cell per move",
    "boundary": "no path leaves the site",
    "cells": "no cell of the part meets a filled cell, by boolean grids rebuilt for every lift",
    "triangles": "if neighbours share cells, their triangles keep the tolerance (FCL, finely sampled)",
    "rope": "everything above the hook is free up to the jib",
    "reach": "the hook stays within reach, the load within the load chart, and both outside their exclusion zones",
    "margin": "in transit the load keeps its clearance from everything",
    "rope_margin": "in transit hook and rope keep their clearance from everything higher",
    "yard_margin": "a part keeps its clearances while it is upended and turned in the yard",
    "flip": "a part that is turned over between two hooks: their shares by statics, their capacities, the ground",
    "tandem": "a part that two cranes carry: their shares by statics, also out of level, and both load charts",
    "rest_margin": "a load keeps its clearances straight up from the yard and on its last moves",
    "motion_margin": "the moving load, hook and rope keep these clearances, along the chords between samples",
    "wind": "the sail area of every part permits the site's wind speed; where that is a default, less wind is stated",
    "support": "a part is set after the parts that it rests on",
    "yard": "parts in the yard do not collide, one delivery at a time",
    "gap": "when a part is picked, the slinger can walk around it",
    "stacks": "stacks keep their limits, each part lies within the next, and nothing lies on what is picked",
    "racks": "walls in racks stand so that the first lifted is outermost, and each rack's frame has room",
    "timeline": "lifts follow each other on one clock without gaps, phases in their order, named by what is done",
    "axis_limits": "no axis exceeds its rate, acceleration or jerk, measured by differences of the samples",
    "axis_range": "the hook stays between minimum radius and jib end, and above the ground",
    "ends": "the motion begins at the part's place in the yard and ends at its place in the building",
    "rests": "the crane is at rest at both ends and at every corner",
    "spacing": "the hook moves at most half a cell between two samples",
    "capacity": "load and rigging are within the load chart at every sample",
    "motion_cells": "the moving load meets no filled cell, along the chords between samples",
    "motion_triangles": "on the last moves the triangles keep the tolerance",
    "motion_rope": "the moving rope is free up to the jib",
    "empty_hook": "the empty hook meets nothing on its way to the next part",
    "zones": "hook and load stay outside their exclusion zones, and the hook at the height that limiters require",
    "jib": "the slewing jib meets nothing",
    "swing": "loads are at rest when set and hit nothing before, by a pendulum driven by the samples",
    "gust": "a gust of the wind in which a lift is permitted swings the load no further than it keeps clear in transit",
    "cranes": "the cranes keep their distance at every moment, also after an emergency stop of one or all of them",
    "together": "two hooks that carry a part keep their distance, both cranes keep time, and no other part is lifted",
    "set_ups": "a crane that moves is in one place at a time, moves in the time asked for, and stands clear of parts",
    "turns": "cranes wait for each other: no part is hooked on or set before the parts that must come before it",
    "digests": "the hashes in the log match its content",
    "load_poses": "the load poses shown by viewers follow from the crane's axes",
    "joint_states": "the joints shown by viewers are those of the motion",
    "commands": "a crane that follows the commanded rates executes the motion",
}
"""What each check of the proof checks."""


def fixed(value: float, digits: int) -> str:
    """Return a number with this many decimals, thousands separated."""
    return f"{value:,.{digits}f}"


def length(value_m: float) -> str:
    """Return a length to the centimetre, without trailing zeros: ``42 m``, ``31.43 m``."""
    return f"{round(value_m, 2):g} m"


def percent(share: float, digits: int) -> str:
    """Return a share in percent: ``43.2 %``."""
    return f"{fixed(share * 100, digits)} %"


def span(seconds: float) -> str:
    """Return a duration: ``36.6 s``, ``4 min 12 s``, ``1 h 5 min``."""
    if seconds < 60.0:
        return f"{seconds:.1f} s"
    whole = round(seconds)
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    minutes = round(seconds / 60.0)
    return f"{minutes // 60} h {minutes % 60} min"


def tonnes(kg: float) -> str:
    """Return a mass in tonnes with sensible digits: ``0.047``, ``2.41``, ``380.6``."""
    return fixed(kg / 1000.0, 3 if abs(kg) < 999.5 else 2 if abs(kg) < 99_995.0 else 1)


def ranges(numbers: Iterable[int]) -> list[str]:
    """Return ascending numbers, those that follow each other as a range: ``3``, ``5 to 8``."""
    runs: list[list[int]] = []
    for one in numbers:
        if runs and one == runs[-1][-1] + 1:
            runs[-1].append(one)
        else:
            runs.append([one])
    return [str(run[0]) if len(run) == 1 else f"{run[0]} to {run[-1]}" for run in runs]


def named(lift: dict[str, Any]) -> str:
    """Return a part's name, or its GlobalId if it has none."""
    return str(lift["name"] or lift["global_id"] or lift["id"])


def names_of(record: dict[str, Any]) -> dict[str, str]:
    """Return the parts of a record by id: name or class first, id in brackets."""
    return {lift["id"]: part_name(lift["id"], lift["name"], lift["ifc_class"]) for lift in record["lifts"]}
