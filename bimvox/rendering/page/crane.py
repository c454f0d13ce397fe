"""The crane as lines and boxes attached to the joints that move them."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from bimvox.crane.links import links_of
from bimvox.crane.machine import identity
from bimvox.crane.tower_crane import TowerCrane
from bimvox.records.declared import LATER, Count, Maybe, Record, Several
from bimvox.rendering.page.geometry import COLOUR, NUMBERS, Blob
from bimvox.rendering.pictures.cranes import MATERIAL_RGB, lines_of
from bimvox.site.config.validation import Point3

FIXED, SLEWING, TROLLEY, HOOK, LUFFING = range(5)
"""Joints that move a point: none; slewing; slewing and trolley; all three axes; slewing and luffing."""
_NOWHERE = (0.0, 0.0, 0.0)

_LINES = Record(
    "PageLines",
    "The lines of a drawn crane.",
    ("points", NUMBERS, "Two ends of each line, x, y, z in the frame of their joints."),
    ("joints", NUMBERS, "The joint of each end."),
    ("styles", NUMBERS, "Of each line: red, green, blue, width in pixels, width in metres."),
)
_BLOCK = Record(
    "PageBlock",
    "A box of a drawn crane.",
    ("centre_m", Point3, "Its centre in the frame of its joint."),
    ("half_m", tuple[Point3, Point3, Point3], "Its three half edges."),
    ("rgb", COLOUR, "Its colour."),
    ("joint", Annotated[int, Field(ge=0, le=4)], "Its joint."),
)
_OVERRIDE = Record(
    "PageOverride",
    "What the site file changes in a machine.",
    ("key", str, "The key."),
    ("catalogue", str, "The machine's value."),
    ("site", str, "The site's value."),
)
_JIB = Record(
    "PageJib",
    "A luffing jib, or a boom.",
    ("pivot_offset_m", float, "Radius of the pivot."),
    ("pivot_height_m", float, "Height of the pivot."),
    ("length_m", float, "From pivot to tip."),
)
_CHART = Record(
    "PageChart",
    "A load chart.",
    ("radius_m", tuple[float, ...], "Radii, ascending.", lambda chart: list(chart.radius_m)),
    ("capacity_kg", tuple[float, ...], "Capacity at each: load, rigging and hook block.",
     lambda chart: list(chart.capacity_kg)),
)  # fmt: skip
CRANE = Record(
    "PageCrane",
    "A crane. Joints: 0 fixed; 1 slewing; 2 with the trolley; 3 with the hook; 4 with the luffing jib.",
    ("name", str, "Its name.", LATER),
    ("machine", str, "Its machine.", LATER),
    ("jib_length_m", float, "Largest hook radius.", LATER),
    ("falls", Count, "Parts of rope that carry the hook.", LATER),
    ("overrides", Several(_OVERRIDE), "What the site file changes.", LATER),
    ("kind", Literal["hammerhead", "luffing", "mobile"], "Its kind."),
    ("luffing", Maybe(_JIB), "Null for a jib with a trolley.", lambda crane: crane.luffing and _JIB.of(crane.luffing)),
    ("base_m", Point3, "Foot of the slewing axis.", lambda crane: list(crane.base_m)),
    ("jib_height_m", float, "Height of the rope exit; of a luffing jib its highest."),
    ("min_radius_m", float, "Smallest hook radius."),
    ("mast_size_m", float, "Edge of the mast."),
    ("sling_m", float, "Height of the slings of the empty hook."),
    ("rigging_mass_kg", float, "Mass of rigging and hook block.", "tackle_kg"),
    ("chart", _CHART, "Its load chart.", lambda crane: _CHART.of(crane.chart)),
    ("lines", _LINES, "How it is drawn: lines.", LATER),
    ("blocks", Several(_BLOCK), "How it is drawn: boxes.", LATER),
)


def crane_record(crane: TowerCrane, blob: Blob) -> dict[str, Any]:
    """Return the crane's numbers, and its lines and boxes with the joint of each point.

    Coordinates are in the joint's frame: relative to the foot of the slewing axis at z = 0, at slewing angle, radius
    and height 0; on a luffing jib relative to its pivot, x along the jib.
    """
    jib, links = crane.luffing, links_of(crane)
    slewing_m = (0.0, 0.0, crane.jib_height_m if jib is None else jib.pivot_height_m)
    on = {
        "crane_base": (FIXED, crane.base_m),
        "jib": (SLEWING, slewing_m) if jib is None else (LUFFING, _NOWHERE),
        "platform": (SLEWING, slewing_m),
        "trolley": (TROLLEY, slewing_m),
        "hook": (HOOK, _NOWHERE),
    }
    lines = [(style, ends) for style, several in lines_of(crane) for ends in several]
    points = [np.array(point) + on[link][1] for _, ends in lines for link, point in ends]
    joints = [on[link][0] for _, ends in lines for link, _ in ends]
    styles = [(*style.rgb, style.width_px, style.width_m) for style, _ in lines]
    blocks = [
        _BLOCK.made(
            (np.array(box.centre_m) + on[link][1]).tolist(),
            np.diag(np.array(box.size_m) / 2.0).tolist(),
            list(MATERIAL_RGB[box.material]),
            on[link][0],
        )
        for link, boxes in links.boxes.items()
        for box in boxes
        if not box.lattice
    ]
    numbers = (np.array(points, np.float32), np.array(joints, np.uint8), np.array(styles, np.float32))
    drawn = _LINES.made(*(blob.put(each) for each in numbers))
    return identity(crane) | CRANE.of(crane) | {"lines": drawn, "blocks": blocks}
