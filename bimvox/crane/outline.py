"""Outline of a crane: jib, counter-jib, mast, rope and load as simple solids; also as a URDF robot.

Everything that slews is a strip along a ray from the slewing axis: two radii, a half width and two heights. The load on
the rope is a disc on plan. Two cranes are compared on plan, part by part, if the heights of the parts are near each
other. The solids contain the crane as it is rendered.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import dataclass

from bimvox.crane.tower_crane import AxisLimits, LuffingJib, TowerCrane

COUNTER_JIB_SHARE = 0.28
"""Length of a hammerhead's counter-jib as a share of its jib length."""
HOOK_BLOCK_M = (0.5, 0.5, 1.0)
"""Length, width and height of the hook block; its lowest point is the hook."""

_UNDER_JIB_M = 0.5
"""Trolley and catwalk below the rope's exit."""


@dataclass(frozen=True, slots=True)
class CraneOutline:
    """Solids of a crane that do not depend on its load.

    Attributes:
        name: Name of the crane, for messages.
        base_m: (x, y) of the slewing axis.
        jib_end_m: Radius of the jib's end; for a luffing jib at the smallest luff angle.
        jib_half_m: Half the jib's width.
        jib_m: Lowest and highest point of the jib above z = 0; for a luffing jib from the pivot to the highest tip.
        tail_m: Length of the counter-jib, or of the counterweight behind the axis.
        tail_half_m: Half its width.
        tail_height_m: Its lowest and highest point.
        mast_half_m: Radius of the circle around the mast section.
        mast_height_m: Lowest and highest point of the mast and its head.
        rope_top_m: Height of the rope exit; for a luffing jib the highest tip.
        luffs: Whether the jib luffs; if so, it ends above the hook.
    """

    name: str
    base_m: tuple[float, float]
    jib_end_m: float
    jib_half_m: float
    jib_m: tuple[float, float]
    tail_m: float
    tail_half_m: float
    tail_height_m: tuple[float, float]
    mast_half_m: float
    mast_height_m: tuple[float, float]
    rope_top_m: float
    luffs: bool

    @property
    def solids_m(self) -> tuple[float, ...]:
        """The 14 lengths above, in their order, from ``base_m`` to ``rope_top_m``, for compiled code."""
        return (
            *self.base_m,
            self.jib_end_m,
            self.jib_half_m,
            *self.jib_m,
            self.tail_m,
            self.tail_half_m,
            *self.tail_height_m,
            self.mast_half_m,
            *self.mast_height_m,
            self.rope_top_m,
        )


def outline_of(crane: TowerCrane) -> CraneOutline:
    """Return the solids of a crane."""
    x, y, foot_m = crane.base_m
    width = crane.mast_size_m
    mast_half = width / 2.0**0.5
    jib = crane.luffing
    if jib is not None:
        top = jib.highest_tip_m + jib.width_m / 2.0
        return CraneOutline(
            crane.name,
            (x, y),
            jib_end_m=jib.radii_m[1],
            jib_half_m=jib.width_m / 2.0,
            jib_m=(jib.pivot_height_m - jib.width_m / 2.0, top),
            tail_m=jib.tail_radius_m,
            tail_half_m=jib.tail_width_m / 2.0,
            tail_height_m=(jib.tail_low_m, jib.pivot_height_m + jib.width_m),
            mast_half_m=mast_half,
            mast_height_m=(foot_m, jib.pivot_height_m),
            rope_top_m=jib.highest_tip_m,
            luffs=True,
        )
    top = highest_point_m(crane)
    return CraneOutline(
        crane.name,
        (x, y),
        jib_end_m=crane.jib_length_m + width / 2.0,
        jib_half_m=width / 2.0,
        jib_m=(crane.jib_height_m - _UNDER_JIB_M, top),
        tail_m=counter_jib_m(crane),
        tail_half_m=width / 2.0,
        tail_height_m=(crane.jib_height_m - width, top),
        mast_half_m=mast_half,
        mast_height_m=(foot_m, top),
        rope_top_m=crane.jib_height_m,
        luffs=False,
    )


def counter_jib_m(crane: TowerCrane) -> float:
    """Return the length of a hammerhead's counter-jib."""
    return max(COUNTER_JIB_SHARE * crane.jib_length_m, 3.0 * crane.mast_size_m)


def tower_head_m(crane: TowerCrane) -> float:
    """Return the height of a hammerhead's tower head above its jib, metres."""
    width = crane.mast_size_m
    return min(max(0.12 * crane.jib_length_m, 2.0 * width), 5.0 * width)


def highest_point_m(crane: TowerCrane) -> float:
    """Return the height of the highest point of a crane above the site's z = 0."""
    if crane.luffing is not None:
        return crane.luffing.highest_tip_m + crane.luffing.width_m / 2.0
    return crane.jib_height_m + tower_head_m(crane)


Box = tuple[tuple[float, float, float], tuple[float, float, float]]


def mast_box_m(crane: TowerCrane) -> Box:
    """Return the lowest and the highest corner of the mast, from its foot up to the jib, metres.

    A luffing crane's mast ends at the pivot; for a mobile crane it is the box of undercarriage and outriggers.
    """
    x, y, z = crane.base_m
    half = crane.mast_size_m / 2.0
    top_m = crane.jib_height_m if crane.luffing is None else crane.luffing.pivot_height_m
    return (x - half, y - half, z), (x + half, y + half, top_m)


# The crane as a URDF robot: links of boxes, joints ``slewing``, ``trolley`` or ``luffing``, and ``hoist``.
#
# The joint names and meanings are those of the log's joint states: slewing rad, trolley m from the slewing axis or
# luffing rad above the horizontal, hoist m of rope below the jib. Specification: http://wiki.ros.org/urdf/XML.


def urdf(crane: TowerCrane, prefix: str = "") -> str:
    """Return the crane's URDF, an XML text that ends with a line break.

    Frames: ``site`` (the site's frame), ``crane_base`` (foot of the slewing axis), ``jib`` (on the axis at the height
    of the rope exit, x along the jib), ``trolley``, ``hook`` (the hook's point, its block above it).

    ``prefix``: prefix of the names of its links and joints, except ``site``, if the site has several cranes.
    """
    robot = _hammerhead_robot(crane) if crane.luffing is None else _luffing_robot(crane, crane.luffing)
    _put_before(robot, prefix)
    return _text(robot)


def _hammerhead_robot(crane: TowerCrane) -> ET.Element:
    robot = ET.Element("robot", name=crane.name)
    mast, counter = crane.mast_size_m, counter_jib_m(crane)
    deck = mast / 2.0
    height = crane.jib_height_m - crane.base_m[2]
    ET.SubElement(robot, "link", name="site")
    base = _link(robot, "crane_base")
    _box(base, "mast", (mast, mast, height), (0.0, 0.0, height / 2.0))
    jib = _link(robot, "jib")
    _box(jib, "jib", (crane.jib_length_m, deck, deck), (crane.jib_length_m / 2.0, 0.0, deck / 2.0))
    _box(jib, "counter_jib", (counter, deck, deck), (-counter / 2.0, 0.0, deck / 2.0))
    _box(jib, "counterweight", (mast, mast, mast), (-counter + mast / 2.0, 0.0, -mast / 2.0))
    _box(_link(robot, "trolley"), "trolley", (deck, deck, 0.25), (0.0, 0.0, 0.125))
    _box(_link(robot, "hook"), "hook", HOOK_BLOCK_M, (0.0, 0.0, HOOK_BLOCK_M[2] / 2.0))
    _joint(robot, "site_to_crane_base", "fixed", "site", "crane_base", crane.base_m)
    slewing = _joint(robot, "slewing", "continuous", "crane_base", "jib", (0.0, 0.0, height), (0, 0, 1))
    _limit(slewing, crane.slewing)
    trolley = _joint(robot, "trolley", "prismatic", "jib", "trolley", (0.0, 0.0, 0.0), (1, 0, 0))
    _limit(trolley, crane.trolley, (crane.min_radius_m, crane.jib_length_m))
    hoist = _joint(robot, "hoist", "prismatic", "trolley", "hook", (0.0, 0.0, 0.0), (0, 0, -1))
    _limit(hoist, crane.hoist, (0.0, height))
    return robot


def _luffing_robot(crane: TowerCrane, jib: LuffingJib) -> ET.Element:
    """Return the URDF of a luffing crane.

    Frames: ``site``, ``crane_base``, ``platform`` (slews), ``jib`` (at the pivot, x along the jib), ``tip`` (at its
    end, kept level by a joint that mimics the luffing), ``hook``.
    """
    robot = ET.Element("robot", name=crane.name)
    ET.SubElement(robot, "link", name="site")
    base, pivot_m = _link(robot, "crane_base"), jib.pivot_height_m - crane.base_m[2]
    foot = crane.mast_size_m
    _box(base, "mast", (foot, foot, pivot_m), (0.0, 0.0, pivot_m / 2.0))
    platform, tail_m = _link(robot, "platform"), max(jib.pivot_height_m - jib.tail_low_m, 0.5)
    tail = (jib.tail_radius_m, jib.tail_width_m, tail_m)
    _box(platform, "counterweight", tail, (-jib.tail_radius_m / 2.0, 0.0, -tail_m / 2.0))
    _box(_link(robot, "jib"), "jib", (jib.length_m, jib.width_m, jib.width_m), (jib.length_m / 2.0, 0.0, 0.0))
    _link(robot, "tip")
    _box(_link(robot, "hook"), "hook", HOOK_BLOCK_M, (0.0, 0.0, HOOK_BLOCK_M[2] / 2.0))
    _joint(robot, "site_to_crane_base", "fixed", "site", "crane_base", crane.base_m)
    _limit(
        _joint(robot, "slewing", "continuous", "crane_base", "platform", (0.0, 0.0, pivot_m), (0, 0, 1)), crane.slewing
    )
    luffing = _joint(robot, "luffing", "revolute", "platform", "jib", (jib.pivot_offset_m, 0.0, 0.0), (0, -1, 0))
    _limit(luffing, jib.limits, jib.luff_rad)
    level = _joint(robot, "level", "revolute", "jib", "tip", (jib.length_m, 0.0, 0.0), (0, 1, 0))
    _limit(level, jib.limits, jib.luff_rad)
    ET.SubElement(level, "mimic", joint="luffing", multiplier="1", offset="0")
    hoist = _joint(robot, "hoist", "prismatic", "tip", "hook", (0.0, 0.0, 0.0), (0, 0, -1))
    _limit(hoist, jib.winch, (0.0, jib.highest_tip_m - crane.base_m[2]))
    return robot


def _put_before(robot: ET.Element, prefix: str) -> None:
    """Add the prefix to all names of links and joints."""
    for element in robot.iter():
        for key in ("name", "link", "joint"):
            names = element.tag in ("link", "joint") if key == "name" else element.tag in ("parent", "child", "mimic")
            if names and (name := element.get(key)) not in (None, "site"):
                element.set(key, f"{prefix}{name}")


def _text(robot: ET.Element) -> str:
    ET.indent(robot)
    return '<?xml version="1.0"?>\n' + ET.tostring(robot, encoding="unicode") + "\n"


def _link(robot: ET.Element, name: str) -> ET.Element:
    return ET.SubElement(robot, "link", name=name)


def _box(link: ET.Element, name: str, size_m: Sequence[float], centre_m: Sequence[float]) -> None:
    for kind in ("visual", "collision"):
        shape = ET.SubElement(link, kind, name=name)
        ET.SubElement(shape, "origin", xyz=_numbers(centre_m), rpy="0 0 0")
        ET.SubElement(ET.SubElement(shape, "geometry"), "box", size=_numbers(size_m))


def _joint(
    robot: ET.Element,
    name: str,
    kind: str,
    parent: str,
    child: str,
    origin_m: Sequence[float],
    axis: Sequence[float] | None = None,
) -> ET.Element:
    joint = ET.SubElement(robot, "joint", name=name, type=kind)
    ET.SubElement(joint, "parent", link=parent)
    ET.SubElement(joint, "child", link=child)
    ET.SubElement(joint, "origin", xyz=_numbers(origin_m), rpy="0 0 0")
    if axis is not None:
        ET.SubElement(joint, "axis", xyz=_numbers(axis))
    return joint


def _limit(joint: ET.Element, limits: AxisLimits, span: tuple[float, float] | None = None) -> None:
    limit = ET.SubElement(joint, "limit", effort="0", velocity=_number(limits.rate))
    if span is not None:
        limit.set("lower", _number(span[0]))
        limit.set("upper", _number(span[1]))


def _numbers(values: Sequence[float]) -> str:
    return " ".join(_number(value) for value in values)


def _number(value: float) -> str:
    return f"{value:.9g}"
