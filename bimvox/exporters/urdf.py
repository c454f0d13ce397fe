"""One lift as a URDF robot with masses and inertia: the crane of the log, with rope, slings and load as further links.

The joints of the crane are those of the log's ``crane.urdf``. Between jib and hook, and between hook and load, two
``continuous`` joints without friction let the rope and the slings swing.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Sequence

from bimvox.crane.links import urdf as crane_urdf
from bimvox.exporters.hung_load import TINY, HungLoad, Inertia, inertia_of

_NOWHERE = Inertia(TINY[0], (0.0, 0.0, 0.0), TINY[1])


def urdf(lift: HungLoad) -> bytes:
    """Return the robot of a lift as the bytes of an XML file."""
    robot = ET.fromstring(crane_urdf(lift.crane))
    for link in robot.findall("link"):
        boxes = lift.links.boxes.get(str(link.get("name")))
        if boxes is not None:
            is_hook = link.get("name") == "hook"
            _add_inertia(link, Inertia(lift.block_kg, (0.0, 0.0, 0.0), TINY[1]) if is_hook else inertia_of(boxes))
    hoist = next(joint for joint in robot.findall("joint") if joint.get("name") == "hoist")
    carrier, exit_at = hoist.find("parent"), hoist.find("origin")
    assert carrier is not None
    assert exit_at is not None
    _add_swing(robot, str(carrier.get("link")), "rope", str(exit_at.get("xyz")))
    carrier.set("link", "rope")
    exit_at.set("xyz", "0 0 0")
    _add_inertia(ET.SubElement(robot, "link", name="rope"), _NOWHERE)
    _add_swing(robot, "hook", "sling", "0 0 0", child="load")
    _add_load(robot, lift)
    ET.indent(robot)
    text: bytes = ET.tostring(robot, encoding="utf-8", xml_declaration=True)
    return text + b"\n"


def _add_swing(robot: ET.Element, parent: str, name: str, at: str, child: str | None = None) -> None:
    """Add two free joints: the first one's child is a link of its own."""
    between = f"{name}_fork"
    _add_inertia(ET.SubElement(robot, "link", name=between), _NOWHERE)
    for axis, along, above, below, origin in (
        ("x", "1 0 0", parent, between, at),
        ("y", "0 1 0", between, child or name, "0 0 0"),
    ):
        joint = ET.SubElement(robot, "joint", name=f"{name}_{axis}", type="continuous")
        ET.SubElement(joint, "parent", link=above)
        ET.SubElement(joint, "child", link=below)
        ET.SubElement(joint, "origin", xyz=origin, rpy="0 0 0")
        ET.SubElement(joint, "axis", xyz=along)
        ET.SubElement(joint, "dynamics", damping="0", friction="0")


def _add_load(robot: ET.Element, lift: HungLoad) -> None:
    link, load = ET.SubElement(robot, "link", name="load"), lift.load
    _add_inertia(link, load)
    for kind in ("visual", "collision"):
        shape = ET.SubElement(link, kind, name="load")
        ET.SubElement(shape, "origin", xyz=_numbers(load.centre_m), rpy="0 0 0")
        ET.SubElement(ET.SubElement(shape, "geometry"), "box", size=_numbers(lift.size_m))


def _add_inertia(link: ET.Element, own: Inertia) -> None:
    inertial = ET.SubElement(link, "inertial")
    ET.SubElement(inertial, "origin", xyz=_numbers(own.centre_m), rpy="0 0 0")
    ET.SubElement(inertial, "mass", value=f"{own.mass_kg:.9g}")
    xx, yy, zz = (f"{moment:.9g}" for moment in own.moments_kg_m2)
    ET.SubElement(inertial, "inertia", ixx=xx, iyy=yy, izz=zz, ixy="0", ixz="0", iyz="0")


def _numbers(values: Sequence[float]) -> str:
    return " ".join(f"{value:.9g}" for value in values)
