"""All cranes of a site as lines and boxes, each in its own pose."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bimvox.crane.kinematics import joints_of
from bimvox.crane.links import Line, Vec3, counter_jib_m, links_of, struts
from bimvox.crane.tower_crane import CranePose, TowerCrane, tip_height_m
from bimvox.records.motion import LiftMotion, by_each_crane, stays_of
from bimvox.rendering.colours import CONCRETE, CRANE, CRANE_EDGE, ROPE
from bimvox.rendering.pictures.scene import Block, Layer, Strokes
from bimvox.site.component import Rgb
from bimvox.site.site import Site


def site_cranes(
    site: Site,
    poses: Mapping[int, CranePose | None] | None = None,
    loads_m: Mapping[int, NDArray[np.float64] | None] | None = None,
) -> CraneParts:
    """Return the lines and boxes of all cranes of a site.

    Poses and loads ((N, 3) lifting points) are given by the crane's index; other cranes are parked, other hooks empty.
    A crane that moves stands where it has a pose; without any, it is drawn in each of its set-ups.
    """
    poses, loads_m = poses or {}, loads_m or {}
    parts = [
        crane_parts(crane, poses.get(number) or parked_pose(site, crane), loads_m.get(number))
        for number, crane in enumerate(site.cranes)
        if site.moving is None or not poses or number in poses
    ]
    if len(parts) == 1:
        return parts[0]
    return CraneParts(
        tuple(stroke for part in parts for stroke in part.strokes),
        tuple(block for part in parts for block in part.blocks),
        np.concatenate([np.zeros((0, 3)), *(part.points_m for part in parts)]),
    )


def poses_at(site: Site, motions: Sequence[LiftMotion], time_ns: int) -> dict[int, CranePose]:
    """Return every crane's pose at a time; a crane rests where its last motion ends, one that moves in one set-up."""
    poses, there = {}, list(range(len(site.cranes)))
    if site.moving is not None:
        stays = stays_of(motions)
        there = [stay.crane for stay in (*stays[:1], *(one for one in stays if one.from_ns <= time_ns))][-1:]
    for number in there:
        own = [motion for motion in by_each_crane(motions) if motion.crane == number]
        begun = [motion for motion in own if motion.start_ns <= time_ns]
        if own:
            motion = max(begun, key=lambda motion: motion.start_ns) if begun else own[0]
            at_ns, axes = motion.samples()
            slew, radius, height = (float(np.interp(time_ns, at_ns, axis)) for axis in axes.T)
            poses[number] = CranePose(slew, radius, height)
    return poses


def parked_pose(site: Site, crane: TowerCrane) -> CranePose:
    """Return the pose of an idle crane: the jib over the building, the hook up."""
    middle = building_centre_m(site)
    dx, dy = middle[0] - crane.base_m[0], middle[1] - crane.base_m[1]
    radius = min(max(math.hypot(dx, dy), crane.min_radius_m), crane.jib_length_m)
    height = crane.jib_height_m - 2.0 * crane.mast_size_m
    if crane.luffing is not None:
        height = float(tip_height_m(crane.luffing, np.array([radius]))[0]) - 3.0
    return CranePose(math.atan2(dy, dx), radius, height)


def building_centre_m(site: Site) -> NDArray[np.float64]:
    """Return the middle of all targets, metres: (3,)."""
    centres = [np.array(c.target_vox) + np.array(c.shape.size_vox) / 2.0 for c in site.components]
    middle: NDArray[np.float64] = site.frame.corner_of(np.mean(centres, axis=0))
    return middle


# A crane as lattice lines and a few boxes, in a pose.


@dataclass(frozen=True, slots=True, eq=False)
class CraneParts:
    """The lines and boxes of a drawn crane.

    Attributes:
        strokes: Lattice, ties, rope and slings.
        blocks: Foot, cab, counterweight, trolley and hook block.
        points_m: (N, 3) points that must be visible: foot, top, and the jib a little beyond the trolley. The ends of
            jib and counter-jib may be cropped, because a long jib would make the building tiny.
    """

    strokes: tuple[Strokes, ...]
    blocks: tuple[Block, ...]
    points_m: NDArray[np.float64]


MATERIAL_RGB: dict[str, Rgb] = {"steel": CRANE, "dark": CRANE_EDGE, "concrete": CONCRETE, "glass": (196, 206, 214)}
_BEYOND = 0.1


class Style(NamedTuple):
    """How lines of a crane are drawn; see ``Strokes``."""

    rgb: Rgb
    width_px: float
    width_m: float
    edge: Rgb | None


Ends = tuple[tuple[str, Vec3], tuple[str, Vec3]]
"""Each end of a line: a link, and a point in its frame, metres."""


def lines_of(crane: TowerCrane) -> list[tuple[Style, list[Ends]]]:
    """Return the lines of a drawn crane by their style: ties, lacing, chords and ropes, in the order of drawing."""
    links = links_of(crane)
    chords: list[Ends] = []
    lacing: list[Ends] = []

    def on(link: str, lines: list[Line]) -> list[Ends]:
        return [((link, start), (link, end)) for start, end in lines]

    for link, boxes in links.boxes.items():
        for box in boxes:
            if box.lattice:
                strong, weak = struts(box)
                chords += on(link, strong)
                lacing += on(link, weak)
    ties, legs, ropes = ([stay[1:] for stay in links.stays if stay.kind == kind] for kind in ("tie", "leg", "rope"))
    width = links.section_m
    thick = (0.08 if crane.luffing is None else 0.06) * width
    return [
        (Style(CRANE_EDGE, 0.9, 0.02 * width, None), ties),
        (Style(CRANE, 0.9, 0.6 * thick, CRANE_EDGE), lacing),
        (Style(CRANE, 1.5, thick, CRANE_EDGE), chords + legs),
        (Style(ROPE, 1.1, 0.02 * width, None), ropes),
    ]


def crane_parts(crane: TowerCrane, pose: CranePose, load_m: ArrayLike | None = None) -> CraneParts:
    """Return the lines and boxes of a crane; ``load_m`` are (N, 3) lifting points of the load, None without one."""
    links, axes = links_of(crane), np.array([[pose.slew_rad, pose.radius_m, pose.height_m]])
    frames = links.frames(joints_of(crane, axes)[0])

    def at(points: Sequence[tuple[str, Vec3]]) -> NDArray[np.float64]:
        """Return (N, 3) points of links in the site's frame."""
        rows = [frames[link][0] + frames[link][1] @ np.array(point) for link, point in points]
        return np.array(rows).reshape(-1, 3)

    slings = [] if load_m is None else [(at([("hook", (0.0, 0.0, 0.0))])[0], point) for point in np.asarray(load_m)]
    strokes = []
    for style, lines in lines_of(crane):
        segments_m = at([end for line in lines for end in line]).reshape(-1, 2, 3)
        if slings and style.rgb == ROPE:
            segments_m = np.concatenate([segments_m, np.array(slings, np.float64)])
        rgb, width_px, width_m, edge = style
        strokes.append(Strokes(segments_m, rgb, width_px, width_m, edge=edge, layer=Layer.CRANE))
    blocks = [
        Block(at([(link, box.centre_m)])[0], (frames[link][1] * box.size_m).T / 2.0, MATERIAL_RGB[box.material])
        for link, boxes in links.boxes.items()
        for box in boxes
        if not box.lattice
    ]
    apex = next(stay.start for stay in links.stays if stay.kind == "tie")
    if crane.luffing is None:
        shown_m = min(pose.radius_m + _BEYOND * crane.jib_length_m, crane.jib_length_m)
        ends = [("jib", (shown_m, 0.0, 0.8 * crane.mast_size_m)), ("jib", (-_BEYOND * counter_jib_m(crane), 0.0, 0.0))]
    else:
        ends = [("tip", (0.0, 0.0, 0.0)), ("platform", (-crane.luffing.tail_radius_m, 0.0, 0.0))]
    foot, hook = ("crane_base", (0.0, 0.0, 0.0)), ("hook", (0.0, 0.0, 0.0))
    return CraneParts(tuple(strokes), tuple(blocks), at([foot, apex, ends[0], hook, ends[1]]))
