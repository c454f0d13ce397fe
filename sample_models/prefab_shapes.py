"""The outlines and dimensions of the precast parts: plain geometry in metres, no IFC.

Parts do not touch: they rest on 20 mm of grout or 10 mm bearing strips, with joints of 10 to 20 mm around them. Each
can be lowered straight down when the parts below it are in place.
"""

from __future__ import annotations

from itertools import pairwise
from math import cos, pi, sin

from sample_models.ifc_entities import Point2

Outline = list[Point2]

LINES_X_M = (0.0, 6.0, 12.0)
LINES_Y_M = (0.0, 5.4, 10.8)
STOREY_M = 3.30
STOREYS = 3
GROUND_FLOOR_M = 0.30
"""Height of the ground floor above the formation level, which carries the footings and has z = 0."""

GROUT_M = 0.020
BEARING_M = 0.010
JOINT_M = 0.010

COLUMN_M = 0.40
CORBEL_REACH_M, CORBEL_TIP_M, CORBEL_ROOT_M = 0.25, 0.15, 0.30
BEAM_DEPTH_M, LEDGE_REACH_M = 0.50, 0.15
BEAM_LENGTH_M = LINES_X_M[1] - COLUMN_M - 2 * GROUT_M

SLAB_M, SLAB_MODULE_M = 0.20, 1.20
SLAB_LENGTH_M = LINES_Y_M[1] - COLUMN_M - 2 * GROUT_M
MODULES = 5
CORES_PER_SLAB, CORE_RADIUS_M = 6, 0.07

RISER_M, GOING_M, TREADS = STOREY_M / 18, 0.27, 8
FLIGHT_WIDTH_M, WAIST_M = 1.00, 0.18
NIB_M, TOE_M = 0.10, 0.13
"""Thickness of the nibs by which a flight rests on the toes of its landings, and the length of these toes."""
FLIGHT_RUN_M = TREADS * GOING_M + TOE_M + 2 * JOINT_M
"""Between the faces of the two landings."""


def area_m2(outline: Outline) -> float:
    """Return the area of a polygon (shoelace formula)."""
    return abs(sum(x0 * y1 - x1 * y0 for (x0, y0), (x1, y1) in pairwise([*outline, outline[0]]))) / 2


def rectangle(low: Point2, high: Point2) -> Outline:
    """Return the four corners of a rectangle."""
    return [low, (high[0], low[1]), high, (low[0], high[1])]


def column_side(corbels: tuple[int, ...]) -> Outline:
    """Return a column in the x-z plane, z = 0 on the floor; corbels towards +x (1), -x (-1) or both."""
    half = COLUMN_M / 2
    tip = half + CORBEL_REACH_M
    top = STOREY_M - BEAM_DEPTH_M - BEARING_M
    corbel = [(half, top - CORBEL_ROOT_M), (tip, top - CORBEL_TIP_M), (tip, top), (half, top)]
    right = corbel if 1 in corbels else []
    left = [(-x, z) for x, z in reversed(corbel)] if -1 in corbels else []
    return [(-half, GROUT_M), (half, GROUT_M), *right, (half, STOREY_M), (-half, STOREY_M), *left]


def beam_section(ledges: tuple[int, ...]) -> Outline:
    """Return a beam in the y-z plane, z = 0 at its top; ledges towards +y (1), -y (-1) or both."""
    half = COLUMN_M / 2
    tip = half + LEDGE_REACH_M
    shelf = -SLAB_M - BEARING_M
    right: Outline = [(tip, -BEAM_DEPTH_M), (tip, shelf), (half, shelf)] if 1 in ledges else [(half, -BEAM_DEPTH_M)]
    left: Outline = [(-half, shelf), (-tip, shelf), (-tip, -BEAM_DEPTH_M)] if -1 in ledges else [(-half, -BEAM_DEPTH_M)]
    return [*right, (half, 0.0), (-half, 0.0), *left]


def slab_section() -> tuple[Outline, list[Outline]]:
    """Return a hollow-core slab in the x-z plane, z = 0 at its top, and its voids."""
    low, high = JOINT_M / 2, SLAB_MODULE_M - JOINT_M / 2
    pitch = (high - low) / CORES_PER_SLAB
    centres = [low + pitch * (i + 0.5) for i in range(CORES_PER_SLAB)]
    # Octagons: accurate enough for lifting, and small.
    angles = [pi / 8 + pi / 4 * i for i in range(8)]
    voids = [[(x + CORE_RADIUS_M * cos(a), CORE_RADIUS_M * sin(a) - SLAB_M / 2) for a in angles] for x in centres]
    return rectangle((low, -SLAB_M), (high, 0.0)), voids


def landing_side(length_m: float, thickness_m: float = SLAB_M) -> Outline:
    """Return a landing in the y-z plane, z = 0 at its top: its face at ``length_m``, and a toe for the flights."""
    toe = -NIB_M - BEARING_M
    tip = length_m + TOE_M
    return [(0, -thickness_m), (tip, -thickness_m), (tip, toe), (length_m, toe), (length_m, 0), (0, 0)]


def flight_side() -> Outline:
    """Return a flight of stairs in the y-z plane: y = 0 at the face, z = 0 at the top of the landing that it leaves.

    It rises ``TREADS + 1`` risers and has a nib at either end, each on the toe of a landing.
    """
    slope = RISER_M / GOING_M
    top = (TREADS + 1) * RISER_M
    back = TREADS * GOING_M + JOINT_M
    nib_end = FLIGHT_RUN_M - JOINT_M
    soffit: Outline = [
        (JOINT_M, -NIB_M),
        ((WAIST_M - NIB_M) / slope, -NIB_M),
        (back, back * slope - WAIST_M),
        (back, top - NIB_M),
        (nib_end, top - NIB_M),
        (nib_end, top),
    ]
    steps: Outline = [(TREADS * GOING_M, top)]
    for i in range(TREADS, 0, -1):
        steps += [(i * GOING_M, i * RISER_M), (max((i - 1) * GOING_M, JOINT_M), i * RISER_M)]
    return soffit + steps


def bracket_side(top_m: float, wall_m: float, reach_m: float) -> Outline:
    """Return a bracket in the x-z plane on the face ``x = wall_m`` of a wall, its bearing at ``top_m``."""
    tip = wall_m + reach_m
    return [(wall_m, top_m - 0.22), (tip, top_m - 0.12), (tip, top_m), (wall_m, top_m)]
