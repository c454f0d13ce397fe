"""The crane as a URDF robot: links of boxes, joints ``slewing``, ``trolley`` or ``luffing``, and ``hoist``.

The joint names and meanings are those of the log's joint states: slewing rad, trolley m from the slewing axis or
luffing rad above the horizontal, hoist m of rope below the jib. Specification: http://wiki.ros.org/urdf/XML.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Sequence

from bimvox.crane.links import Joint, Vec3, links_of
from bimvox.crane.tower_crane import TowerCrane


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
            _add_box(link, *box)
    for joint in links.joints:
        _add_joint(robot, joint)
    _put_before(robot, prefix)
    return _text(robot)


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


def _add_box(link: ET.Element, name: str, size_m: Vec3, centre_m: Vec3) -> None:
    for kind in ("visual", "collision"):
        shape = ET.SubElement(link, kind, name=name)
        ET.SubElement(shape, "origin", xyz=_numbers(centre_m), rpy="0 0 0")
        ET.SubElement(ET.SubElement(shape, "geometry"), "box", size=_numbers(size_m))


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
