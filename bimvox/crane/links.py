"""A crane as links and joints, also as a URDF robot: the one model of the log's transforms, ROS 2 bags and GLB.

Frames: ``site`` (the site's frame), ``crane_base`` (foot of the slewing axis), ``jib`` (on the axis at the height of
the rope exit, x along the jib), ``trolley``, ``hook`` (the hook's point, its block above it). Of a luffing crane:
``platform`` (slews), ``jib`` (at the pivot, x along the jib), ``tip`` (at its end, kept level), ``hook``.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.outline import HOOK_BLOCK_M, counter_jib_m
from bimvox.crane.tower_crane import AxisLimits, LuffingJib, TowerCrane

Vec3 = tuple[float, float, float]
Box = tuple[str, Vec3, Vec3]
"""Name, size and centre of a box in the frame of its link."""


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
        boxes: The boxes of each link, by its name.
        joints: The joints from the site to the hook.
    """

    boxes: dict[str, tuple[Box, ...]]
    joints: tuple[Joint, ...]


def links_of(crane: TowerCrane) -> Links:
    """Return the links and joints of a crane."""
    return _hammerhead(crane) if crane.luffing is None else _luffing(crane, crane.luffing)


_HOOK = (("hook", HOOK_BLOCK_M, (0.0, 0.0, HOOK_BLOCK_M[2] / 2.0)),)
_NOWHERE = (0.0, 0.0, 0.0)


def _hammerhead(crane: TowerCrane) -> Links:
    mast, counter, long = crane.mast_size_m, counter_jib_m(crane), crane.jib_length_m
    deck, height = mast / 2.0, crane.jib_height_m - crane.base_m[2]
    boxes = {
        "crane_base": (("mast", (mast, mast, height), (0.0, 0.0, height / 2.0)),),
        "jib": (
            ("jib", (long, deck, deck), (long / 2.0, 0.0, deck / 2.0)),
            ("counter_jib", (counter, deck, deck), (-counter / 2.0, 0.0, deck / 2.0)),
            ("counterweight", (mast, mast, mast), (-counter + mast / 2.0, 0.0, -mast / 2.0)),
        ),
        "trolley": (("trolley", (deck, deck, 0.25), (0.0, 0.0, 0.125)),),
        "hook": _HOOK,
    }
    reach_m = (crane.min_radius_m, long)
    joints = (
        Joint("site_to_crane_base", "fixed", "site", "crane_base", crane.base_m),
        Joint("slewing", "continuous", "crane_base", "jib", (0.0, 0.0, height), (0, 0, 1), 0, crane.slewing),
        Joint("trolley", "prismatic", "jib", "trolley", _NOWHERE, (1, 0, 0), 1, crane.trolley, reach_m),
        Joint("hoist", "prismatic", "trolley", "hook", _NOWHERE, (0, 0, -1), 2, crane.hoist, (0.0, height)),
    )
    return Links(boxes, joints)


def _luffing(crane: TowerCrane, jib: LuffingJib) -> Links:
    foot, pivot_m = crane.mast_size_m, jib.pivot_height_m - crane.base_m[2]
    tail_m = max(jib.pivot_height_m - jib.tail_low_m, 0.5)
    tail = (jib.tail_radius_m, jib.tail_width_m, tail_m)
    boxes = {
        "crane_base": (("mast", (foot, foot, pivot_m), (0.0, 0.0, pivot_m / 2.0)),),
        "platform": (("counterweight", tail, (-jib.tail_radius_m / 2.0, 0.0, -tail_m / 2.0)),),
        "jib": (("jib", (jib.length_m, jib.width_m, jib.width_m), (jib.length_m / 2.0, 0.0, 0.0)),),
        "tip": (),
        "hook": _HOOK,
    }
    foot_m, tip_m, rope_m = (
        (jib.pivot_offset_m, 0.0, 0.0),
        (jib.length_m, 0.0, 0.0),
        jib.highest_tip_m - crane.base_m[2],
    )
    luff = (1, jib.limits, jib.luff_rad)
    joints = (
        Joint("site_to_crane_base", "fixed", "site", "crane_base", crane.base_m),
        Joint("slewing", "continuous", "crane_base", "platform", (0.0, 0.0, pivot_m), (0, 0, 1), 0, crane.slewing),
        Joint("luffing", "revolute", "platform", "jib", foot_m, (0, -1, 0), *luff),
        Joint("level", "revolute", "jib", "tip", tip_m, (0, 1, 0), *luff, follows="luffing"),
        Joint("hoist", "prismatic", "tip", "hook", _NOWHERE, (0, 0, -1), 2, jib.winch, (0.0, rope_m)),
    )
    return Links(boxes, joints)


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
