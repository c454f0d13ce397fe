"""The crane as a URDF robot: links of boxes, joints ``slewing``, ``trolley`` or ``luffing``, and ``hoist``.

The joint names and meanings are those of the log's joint states: slewing rad, trolley m from the slewing axis or
luffing rad above the horizontal, hoist m of rope below the jib. Specification: http://wiki.ros.org/urdf/XML.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Sequence

from bimvox.crane.axis_limits import AxisLimits
from bimvox.crane.luffing import LuffingJib
from bimvox.crane.outline import HOOK_BLOCK_M, counter_jib_m
from bimvox.crane.tower_crane import TowerCrane


def urdf(crane: TowerCrane, prefix: str = "") -> str:
    """Return the crane's URDF, an XML text that ends with a line break.

    Frames: ``site`` (the site's frame), ``crane_base`` (foot of the slewing axis), ``jib`` (on the axis at the height
    of the rope exit, x along the jib), ``trolley``, ``hook`` (the hook's point, its block above it).

    Args:
        crane: The crane.
        prefix: Prefix of the names of its links and joints, except ``site``, if the site has several cranes.
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
