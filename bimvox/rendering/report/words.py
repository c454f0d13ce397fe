"""Numbers and names as the report writes them."""

from __future__ import annotations

from typing import Any

from bimvox.rendering.words import clock as clock_of_ns

METHODS = {"policy": "policy", "retrained": "policy, retrained", "search": "search (A*)"}
MASS_SOURCES = {
    "quantity": "the model's quantities",
    "density": "volume x density of its material",
    "default": "volume x 2,400 kg/m³",
}
SWING = {
    "shaped": "moves are shaped so that loads hang at rest where they are set; the swing on the way is proven clear",
    "off": "NOT LOOKED AT: loads may still swing where they are set, and into things on the way",
}
CHECKS = {
    "complete": "every part has exactly one lift, numbered without gaps; what is infeasible says why",
    "shapes": "a part's cells cover all of its triangles",
    "unit_moves": "every path goes from the part's place in the yard to its place in the building, one cell a move",
    "boundary": "no path leaves the site",
    "cells": "no cell of the part meets a filled cell, by raw boolean grids rebuilt for every lift",
    "triangles": "where neighbours share cells, the real triangles stay within the tolerance (FCL, finely sampled)",
    "rope": "everything above the hook is free up to the jib",
    "reach": "the hook stays within reach, its load within the load chart, both out of zones closed to them",
    "rope_margin": "in transit hook and rope keep their clearance from everything higher",
    "wind": "the sail area of every part allows the wind that the site is to work in",
    "support": "what a part rests on was set before it",
    "yard": "parts wait in the yard without meeting each other, one delivery at a time",
    "timeline": "lifts follow each other on one clock without gaps, phases in their order",
    "axis_limits": "no axis exceeds its rate, acceleration or jerk, by differences of the samples",
    "axis_range": "the hook stays between the smallest radius and the jib's end, and above the ground",
    "ends": "the motion begins at the part's place in the yard and ends at its place in the building",
    "rests": "the crane stands still at both ends and at every corner",
    "spacing": "the hook goes no more than half a cell between two samples",
    "capacity": "load and rigging are within the load chart at every sample",
    "motion_cells": "the moving load meets no filled cell, along the chords between the samples",
    "motion_triangles": "on the last moves the real triangles stay apart within the tolerance",
    "motion_rope": "the moving rope is free up to the jib",
    "empty_hook": "the empty hook meets nothing on its way to the next part",
    "zones": "hook and load stay out of zones that are closed to them, and the hook as high as limiters want it",
    "jib": "the jib meets nothing as it slews",
    "swing": "loads hang at rest at the end of their way (pendulum from the samples) and swing into nothing before",
    "cranes": "the cranes keep their distance at every moment, and whenever one or all of them are stopped",
    "turns": "cranes wait for each other: no part is hooked on, or set, before those that come before it allow it",
    "digests": "the hashes in the log are those of its content",
    "load_poses": "the poses that a viewer shows are where the crane's axes put the load",
    "commands": "a crane that holds the commanded rates goes where the motion goes",
}
"""What each check of the verifier looks at."""


def fixed(value: float, digits: int) -> str:
    """Return a number with that many decimals, thousands separated."""
    return f"{value:,.{digits}f}"


def clock(seconds: float) -> str:
    """Return a time on the site's clock: ``5:56:19``."""
    return clock_of_ns(round(seconds * 1e9))


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
    """Return a mass in tonnes to the kilogram: ``2.413``."""
    return fixed(kg / 1000.0, 3)


def named(lift: dict[str, Any]) -> str:
    """Return what a part is called: its name, else its GlobalId."""
    return str(lift["name"] or lift["global_id"] or lift["id"])
