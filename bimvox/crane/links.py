"""A crane as links, joints and solids: the one model of the robot, the log, ROS 2 bags, GLB, pictures and the page.

Frames: ``site`` (the site's frame), ``crane_base`` (foot of the slewing axis), ``jib`` (on the axis at the height of
the rope exit, x along the jib), ``trolley``, ``hook`` (the hook's point, its block above it). Of a luffing crane:
``platform`` (slews), ``jib`` (at the pivot, x along the jib), ``tip`` (at its end, kept level), ``hook``.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.tower_crane import AxisLimits, LuffingJib, TowerCrane

COUNTER_JIB_SHARE = 0.28
"""Length of a hammerhead's counter-jib that nobody states, as a share of its jib length."""
HOOK_BLOCK_M = (0.5, 0.5, 1.0)
"""Length, width and height of the hook block; its lowest point is the hook."""

Vec3 = tuple[float, float, float]
Line = tuple[Vec3, Vec3]
Material = Literal["steel", "dark", "concrete", "glass"]


class Box(NamedTuple):
    """A solid, in the frame of its link, metres.

    Attributes:
        name: Unique in the crane.
        low_m: Its lowest corner.
        high_m: Its highest corner.
        material: What it is made of.
        lattice: What a drawing shows in its place (``struts``): nothing else, a mast, a jib or the deck of a
            counter-jib.
    """

    name: str
    low_m: Vec3
    high_m: Vec3
    material: Material = "steel"
    lattice: Literal["", "mast", "jib", "deck"] = ""

    @property
    def size_m(self) -> Vec3:
        """Its length, width and height."""
        (a, b, c), (x, y, z) = self.low_m, self.high_m
        return x - a, y - b, z - c

    @property
    def centre_m(self) -> Vec3:
        """Its centre."""
        (a, b, c), (x, y, z) = self.low_m, self.high_m
        return (a + x) / 2.0, (b + y) / 2.0, (c + z) / 2.0


class Stay(NamedTuple):
    """A line between two links, which a drawing shows: a leg of the tower head, a tie, or a fall of the rope.

    Each end is a link and a point in its frame, metres.
    """

    kind: Literal["leg", "tie", "rope"]
    start: tuple[str, Vec3]
    end: tuple[str, Vec3]


@dataclass(frozen=True, slots=True)
class Joint:
    """What joins two links.

    Attributes:
        name: Its name; that of the log's joint states for those that drive the crane.
        kind: Its type, in the words of URDF.
        parent: The link that carries the other one.
        child: The other one.
        origin_m: Where the child's frame is in the parent's, at position 0.
        axis: Along or around which it moves; one of its numbers is 1 or -1.
        column: Its position in a row of :func:`bimvox.crane.kinematics.joints_of`.
        limits: How fast it may move.
        span: Its least and largest position; None: no limit.
        follows: The joint whose position it has.
    """

    name: str
    kind: Literal["fixed", "continuous", "prismatic", "revolute"]
    parent: str
    child: str
    origin_m: Vec3
    axis: tuple[int, int, int] = (0, 0, 0)
    column: int = 0
    limits: AxisLimits | None = None
    span: tuple[float, float] | None = None
    follows: str | None = None

    @property
    def turns(self) -> bool:
        """Whether it turns its child, instead of shifting it."""
        return self.kind in ("continuous", "revolute")

    @property
    def along(self) -> int:
        """The coordinate along or around which it moves."""
        return int(np.flatnonzero(self.axis)[0])

    def moved(self, joints: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return what changes at joint positions ((N, 3)): (N, 2) sine and cosine of a half turn, or (N, 1) metres."""
        sign, at = self.axis[self.along], joints[:, self.column]
        if not self.turns:
            return (at if sign > 0 else -at)[:, None]
        sine = np.sin(at / 2.0)
        return np.stack([sine if sign > 0 else -sine, np.cos(at / 2.0)], axis=1)


@dataclass(frozen=True, slots=True)
class Links:
    """A crane.

    Attributes:
        boxes: The solids of each link, by its name.
        joints: The joints from the site to the hook.
        stays: Lines between links.
        section_m: Width of the lattice of the jib.
    """

    boxes: dict[str, tuple[Box, ...]]
    joints: tuple[Joint, ...]
    stays: tuple[Stay, ...]
    section_m: float

    def frames(self, joints: NDArray[np.float64]) -> dict[str, tuple[NDArray[np.float64], NDArray[np.float64]]]:
        """Return each link's frame in the site's at joint positions ((3,)): origin (3,), and axes as columns (3, 3)."""
        placed = {"site": (np.zeros(3), np.eye(3))}
        for joint in self.joints:
            (origin_m, axes), at_m, turn = placed[joint.parent], np.array(joint.origin_m), np.eye(3)
            if joint.turns:
                angle, a, b = joints[joint.column] * joint.axis[joint.along], joint.along - 2, joint.along - 1
                turn[[a, a, b, b], [a, b, a, b]] = np.cos(angle), -np.sin(angle), np.sin(angle), np.cos(angle)
            elif joint.limits is not None:
                at_m = at_m + np.array(joint.axis) * joints[joint.column]
            placed[joint.child] = origin_m + axes @ at_m, axes @ turn
        return placed


def links_of(crane: TowerCrane) -> Links:
    """Return the links, joints and solids of a crane."""
    return _hammerhead(crane) if crane.luffing is None else _luffing(crane, crane.luffing)


def counter_jib_m(crane: TowerCrane) -> float:
    """Return the length of a hammerhead's counter-jib, as its machine file states it or by the share of its jib."""
    stated_m = None if crane.stand is None else crane.stand.tail_radius_m
    return stated_m or max(COUNTER_JIB_SHARE * crane.jib_length_m, 3.0 * crane.mast_size_m)


def tower_head_m(crane: TowerCrane) -> float:
    """Return the height of a hammerhead's tower head above its jib, metres."""
    width = crane.mast_size_m
    return min(max(0.12 * crane.jib_length_m, 2.0 * width), 5.0 * width)


_NOWHERE = (0.0, 0.0, 0.0)
_SIDES = (-1.0, 1.0)


def _box(name: str, size_m: Vec3, centre_m: Vec3, material: Material = "steel") -> Box:
    low, high = ([at + sign * size / 2.0 for at, size in zip(centre_m, size_m, strict=True)] for sign in _SIDES)
    return Box(name, (low[0], low[1], low[2]), (high[0], high[1], high[2]), material)


_HOOK = (_box("hook", HOOK_BLOCK_M, (0.0, 0.0, HOOK_BLOCK_M[2] / 2.0)),)


def _tower(width: float, height: float) -> tuple[Box, ...]:
    """Return the foot and the mast of a tower crane, in the frame of its base."""
    half = width / 2.0
    foot = _box("foot", (2.2 * width, 2.2 * width, 0.2 * width), (0.0, 0.0, 0.1 * width), "concrete")
    return foot, Box("mast", (-half, -half, 0.0), (half, half, height), lattice="mast")


def _jib(begins_m: float, ends_m: float, width: float) -> Box:
    return Box("jib", (begins_m, -0.35 * width, 0.0), (ends_m, 0.35 * width, 0.8 * width), lattice="jib")


def _hammerhead(crane: TowerCrane) -> Links:
    w, back, long = crane.mast_size_m, counter_jib_m(crane), crane.jib_length_m
    height = crane.jib_height_m - crane.base_m[2]
    boxes = {
        "crane_base": _tower(w, height),
        "jib": (
            _box("ring", (1.1 * w, 1.1 * w, 0.3 * w), (0.0, 0.0, -0.15 * w)),
            _box("cab", (0.9 * w, 0.8 * w, 1.1 * w), (0.3 * w, 0.95 * w, -0.75 * w), "glass"),
            _jib(w / 2.0, long + w / 2.0, w),
            Box("counter_jib", (-back, -0.35 * w, 0.0), (0.0, 0.35 * w, 0.1 * w), lattice="deck"),
            _box("counterweight", (0.2 * back, w, 1.3 * w), (-0.9 * back, 0.0, -0.5 * w), "concrete"),
        ),
        "trolley": (_box("trolley", (0.8 * w, 0.9 * w, 0.2 * w), (0.0, 0.0, -0.15 * w), "dark"),),
        "hook": _HOOK,
    }
    apex = ("jib", (0.0, 0.0, tower_head_m(crane)))
    stays = (
        *(Stay("leg", ("jib", (a * w / 2.0, b * w / 2.0, 0.0)), apex) for a in _SIDES for b in _SIDES),
        *(Stay("tie", apex, ("jib", (share * long, 0.0, 0.8 * w))) for share in (0.36, 0.74)),
        *(Stay("tie", apex, ("jib", (-back, s * 0.35 * w, 0.0))) for s in _SIDES),
        *(Stay("rope", ("trolley", (s * 0.18 * w, 0.0, -0.15 * w)), ("hook", (s * 0.1 * w, 0.0, 0.0))) for s in _SIDES),
    )
    reach_m = (crane.min_radius_m, long)
    joints = (
        Joint("site_to_crane_base", "fixed", "site", "crane_base", crane.base_m),
        Joint("slewing", "continuous", "crane_base", "jib", (0.0, 0.0, height), (0, 0, 1), 0, crane.slewing),
        Joint("trolley", "prismatic", "jib", "trolley", _NOWHERE, (1, 0, 0), 1, crane.trolley, reach_m),
        Joint("hoist", "prismatic", "trolley", "hook", _NOWHERE, (0, 0, -1), 2, crane.hoist, (0.0, height)),
    )
    return Links(boxes, joints, stays, w)


def _luffing(crane: TowerCrane, jib: LuffingJib) -> Links:
    """Return a crane whose jib luffs: a tower crane, or a mobile crane on its outriggers."""
    wide, back, foot_m = jib.width_m, jib.tail_radius_m, crane.base_m[2]
    pivot_m, low_m = jib.pivot_height_m - foot_m, jib.tail_low_m - jib.pivot_height_m
    tail_m, width, on_tower = max(0.8, -low_m), crane.mast_size_m, crane.kind == "luffing"
    deck = _box(
        "platform", (back + jib.pivot_offset_m, jib.tail_width_m, 0.4), ((jib.pivot_offset_m - back) / 2.0, 0.0, 0.0)
    )
    if not on_tower:
        deck = _box("platform", (0.5 * width, jib.tail_width_m, -low_m), (0.0, 0.0, low_m / 2.0))
    tail = (jib.tail_width_m / 2.0, low_m + tail_m)
    boxes = {
        "crane_base": _tower(width, pivot_m) if on_tower else _carrier(width, jib.tail_low_m - foot_m),
        "platform": (deck, Box("counterweight", (-back, -tail[0], low_m), (-0.6 * back, *tail), "concrete")),
        "jib": (_jib(0.0, jib.length_m, wide),),
        "tip": (),
        "hook": _HOOK,
    }
    apex = ("platform", (-0.5 * back, 0.0, 0.22 * jib.length_m if on_tower else 2.0 * wide))
    tip_m = (jib.length_m, 0.0, 0.0)
    stays = (
        *(Stay("leg", ("platform", (jib.pivot_offset_m, s * 0.4 * wide, 0.0)), apex) for s in _SIDES),
        Stay("tie", apex, ("jib", tip_m)),
        *(Stay("tie", apex, ("platform", (-back, s * 0.4 * wide, 0.0))) for s in _SIDES),
        *(
            Stay("rope", ("jib", (jib.length_m, s * 0.2 * wide, 0.0)), ("hook", (0.0, s * 0.1 * wide, 0.0)))
            for s in _SIDES
        ),
    )
    pivot_at_m, rope_m = (jib.pivot_offset_m, 0.0, 0.0), jib.highest_tip_m - foot_m
    luff = (1, jib.limits, jib.luff_rad)
    joints = (
        Joint("site_to_crane_base", "fixed", "site", "crane_base", crane.base_m),
        Joint("slewing", "continuous", "crane_base", "platform", (0.0, 0.0, pivot_m), (0, 0, 1), 0, crane.slewing),
        Joint("luffing", "revolute", "platform", "jib", pivot_at_m, (0, -1, 0), *luff),
        Joint("level", "revolute", "jib", "tip", tip_m, (0, 1, 0), *luff, follows="luffing"),
        Joint("hoist", "prismatic", "tip", "hook", _NOWHERE, (0, 0, -1), 2, jib.winch, (0.0, rope_m)),
    )
    return Links(boxes, joints, stays, wide)


def _carrier(width: float, top_m: float) -> tuple[Box, ...]:
    """Return outrigger pads, their beams and the undercarriage of a mobile crane, below its superstructure."""
    aside = 0.46 * width
    return (
        *(
            _box(f"pad_{n}", (1.0, 1.0, 0.2), (a * aside, b * aside, 0.1), "concrete")
            for n, (a, b) in enumerate(((-1, -1), (-1, 1), (1, -1), (1, 1)), start=1)
        ),
        *(_box(f"beam_{n}", (0.4, 2.0 * aside, 0.4), (a * aside, 0.0, 0.6)) for n, a in enumerate(_SIDES, start=1)),
        _box("undercarriage", (1.25 * width, 2.6, top_m - 0.4), (0.0, 0.0, 0.5 * (0.5 + top_m)), "dark"),
    )


def struts(box: Box) -> tuple[list[Line], list[Line]]:
    """Return chords and lacing of a solid that is a lattice, in the frame of its link, metres."""
    (begins, side, _), (ends, _, top) = box.low_m, box.high_m
    if box.lattice == "mast":
        return _mast_struts(ends, top)
    if box.lattice == "deck":
        return [((ends, s * side, 0.0), (begins, s * side, 0.0)) for s in _SIDES], []
    # Three chords, the upper one a panel shorter.
    panels = max(2, round((ends - begins) / (1.1 * top / 0.8)))
    step = (ends - begins) / panels
    chords: list[Line] = [((begins, s * side, 0.0), (ends, s * side, 0.0)) for s in _SIDES]
    chords.append(((begins + 0.5 * step, 0.0, top), (ends - 0.5 * step, 0.0, top)))
    lacing: list[Line] = []
    for n in range(panels):
        x = begins + n * step
        upper = (x + 0.5 * step, 0.0, top)
        for s in _SIDES:
            lacing += [((x, s * side, 0.0), upper), (upper, (x + step, s * side, 0.0))]
        lacing.append(((x, -side, 0.0), (x, side, 0.0)))
    return chords, lacing


def _mast_struts(half: float, height: float) -> tuple[list[Line], list[Line]]:
    """Return chords and lacing of a mast: one diagonal per panel and side, alternating, and a frame on each panel."""
    corners = [(a * half, b * half) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    chords: list[Line] = [((*corner, 0.0), (*corner, height)) for corner in corners]
    panels = max(1, round(height / (2.8 * half)))
    lacing: list[Line] = []
    for n in range(panels):
        low, high = height * n / panels, height * (n + 1) / panels
        for one, other in zip(corners, (*corners[1:], corners[0]), strict=True):
            start, end = (other, one) if n % 2 else (one, other)
            lacing += [((*start, low), (*end, high)), ((*one, high), (*other, high))]
    return chords, lacing


# As a URDF robot: links of boxes, joints ``slewing``, ``trolley`` or ``luffing``, and ``hoist``.
#
# The joint names and meanings are those of the log's joint states: slewing rad, trolley m from the slewing axis or
# luffing rad above the horizontal, hoist m of rope below the jib. Specification: http://wiki.ros.org/urdf/XML.


def urdf(crane: TowerCrane, prefix: str = "") -> str:
    """Return the crane's URDF, an XML text that ends with a line break.

    Args:
        crane: The crane.
        prefix: Prefix of the names of its links and joints, except ``site``, if the site has several cranes.
    """
    robot, links = ET.Element("robot", name=crane.name), links_of(crane)
    ET.SubElement(robot, "link", name="site")
    for name, boxes in links.boxes.items():
        link = ET.SubElement(robot, "link", name=name)
        for box in boxes:
            for kind in ("visual", "collision"):
                shape = ET.SubElement(link, kind, name=box.name)
                ET.SubElement(shape, "origin", xyz=_numbers(box.centre_m), rpy="0 0 0")
                ET.SubElement(ET.SubElement(shape, "geometry"), "box", size=_numbers(box.size_m))
    for joint in links.joints:
        _add_joint(robot, joint)
    _put_before(robot, prefix)
    ET.indent(robot)
    return '<?xml version="1.0"?>\n' + ET.tostring(robot, encoding="unicode") + "\n"


def _put_before(robot: ET.Element, prefix: str) -> None:
    """Add the prefix to all names of links and joints."""
    for element in robot.iter():
        for key in ("name", "link", "joint"):
            names = element.tag in ("link", "joint") if key == "name" else element.tag in ("parent", "child", "mimic")
            if names and (name := element.get(key)) not in (None, "site"):
                element.set(key, f"{prefix}{name}")


def _add_joint(robot: ET.Element, joint: Joint) -> None:
    made = ET.SubElement(robot, "joint", name=joint.name, type=joint.kind)
    ET.SubElement(made, "parent", link=joint.parent)
    ET.SubElement(made, "child", link=joint.child)
    ET.SubElement(made, "origin", xyz=_numbers(joint.origin_m), rpy="0 0 0")
    if joint.limits is None:
        return
    ET.SubElement(made, "axis", xyz=_numbers(joint.axis))
    limit = ET.SubElement(made, "limit", effort="0", velocity=_number(joint.limits.rate))
    if joint.span is not None:
        limit.set("lower", _number(joint.span[0]))
        limit.set("upper", _number(joint.span[1]))
    if joint.follows is not None:
        ET.SubElement(made, "mimic", joint=joint.follows, multiplier="1", offset="0")


def _numbers(values: Sequence[float]) -> str:
    return " ".join(_number(value) for value in values)


def _number(value: float) -> str:
    return f"{value:.9g}"
