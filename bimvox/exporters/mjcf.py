"""One lift as a MuJoCo model (MJCF): the crane, rope, slings and load, and the commands of its motion.

The joints ``slewing``, ``trolley`` or ``luffing``, and ``hoist`` are driven; ``rope_x``, ``rope_y``, ``sling_x`` and
``sling_y`` swing freely; ``tag_line`` keeps the heading of the load. Servos of the same stiffness drive them, so that
all are late by the same 20 ms. Their commands are custom numbers: ``time_s``, and one list a servo.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Sequence

from bimvox.crane.links import Joint
from bimvox.exporters.hung_load import TINY, HungLoad, Inertia, inertia_of

_STEP_S = 0.002
_STIFF_PER_S = 100.0
"""Natural frequency of the servos, critically damped."""
_COLOURS = {"steel": "0.9 0.7 0.1 1", "dark": "0.2 0.2 0.2 1", "concrete": "0.6 0.6 0.6 1", "glass": "0.5 0.7 0.9 1"}


def mjcf(lift: HungLoad) -> bytes:
    """Return the model of a lift as the bytes of an XML file."""
    root = ET.Element("mujoco", model=lift.name)
    ET.SubElement(root, "compiler", angle="radian", autolimits="true")
    ET.SubElement(root, "option", timestep=_number(_STEP_S), gravity="0 0 -9.80665", integrator="implicitfast")
    ET.SubElement(root, "size", nkey="1")
    world = ET.SubElement(root, "worldbody")
    ET.SubElement(world, "light", pos="0 0 100", dir="0.2 0.2 -1")
    bodies = {"site": world}
    for joint in lift.links.joints:
        bodies[joint.child] = _body(bodies[joint.parent], joint, lift)
    _hang(bodies["hook"], lift)
    _couple(root, lift.links.joints)
    _drive(root, lift)
    ET.indent(root)
    text: bytes = ET.tostring(root, encoding="utf-8", xml_declaration=True)
    return text + b"\n"


def _body(parent: ET.Element, joint: Joint, lift: HungLoad) -> ET.Element:
    """Add the child of a joint; between the jib and the hook, the rope, which swings, comes first."""
    at = _numbers(joint.origin_m)
    if joint.child == "hook":
        parent = ET.SubElement(parent, "body", name="rope", pos=at)
        _swings(parent, "rope")
        _add_inertia(parent, Inertia(TINY[0], (0.0, 0.0, 0.0), TINY[1]))
        at = "0 0 0"
    body = ET.SubElement(parent, "body", name=joint.child, pos=at)
    if joint.kind != "fixed":
        kind = "hinge" if joint.turns else "slide"
        ET.SubElement(body, "joint", name=joint.name, type=kind, axis=_numbers(joint.axis))
    boxes = lift.links.boxes.get(joint.child, ())
    own = inertia_of(boxes)
    _add_inertia(body, Inertia(lift.block_kg, (0.0, 0.0, 0.0), TINY[1]) if joint.child == "hook" else own)
    for box in boxes:
        half = _numbers([edge / 2.0 for edge in box.size_m])
        _add_box(body, f"{joint.child}/{box.name}", _numbers(box.centre_m), half, _COLOURS[box.material])
    return body


def _hang(hook: ET.Element, lift: HungLoad) -> None:
    """Add the load below the hook."""
    body = ET.SubElement(hook, "body", name="load", pos="0 0 0")
    _swings(body, "sling")
    ET.SubElement(body, "joint", name="tag_line", type="hinge", axis="0 0 1")
    load = lift.load
    _add_inertia(body, load)
    half = _numbers([edge / 2.0 for edge in lift.size_m])
    _add_box(body, "load", _numbers(load.centre_m), half, "0.7 0.4 0.3 1")
    ET.SubElement(body, "site", name="load", pos=_numbers(load.centre_m))


def _swings(body: ET.Element, name: str) -> None:
    for axis, along in (("x", "1 0 0"), ("y", "0 1 0")):
        ET.SubElement(body, "joint", name=f"{name}_{axis}", type="hinge", axis=along)


def _add_inertia(body: ET.Element, own: Inertia) -> None:
    moments = _numbers(own.moments_kg_m2)
    ET.SubElement(body, "inertial", pos=_numbers(own.centre_m), mass=_number(own.mass_kg), diaginertia=moments)


def _add_box(body: ET.Element, name: str, at: str, half: str, colour: str) -> None:
    shape = {"name": name, "type": "box", "pos": at, "size": half, "rgba": colour, "contype": "0", "conaffinity": "0"}
    ET.SubElement(body, "geom", shape)


def _couple(root: ET.Element, joints: Sequence[Joint]) -> None:
    followers = [joint for joint in joints if joint.follows is not None]
    if followers:
        couplings = ET.SubElement(root, "equality")
        for joint in followers:
            ET.SubElement(couplings, "joint", joint1=joint.name, joint2=str(joint.follows), polycoef="0 1 0 0 0")


def _drive(root: ET.Element, lift: HungLoad) -> None:
    """Add the servos, their commands, and where all of it is at the beginning."""
    driven = [joint for joint in lift.links.joints if joint.limits is not None and joint.follows is None]
    commands = {joint.name: lift.joints[:, joint.column] for joint in driven}
    commands["tag_line"] = -lift.joints[:, 0]
    total_kg = lift.block_kg + lift.load_kg
    servos, custom = ET.SubElement(root, "actuator"), ET.SubElement(root, "custom")
    for name, course in commands.items():
        moved = _moved(lift, name, total_kg)
        kp, kv = _number(moved * _STIFF_PER_S**2), _number(2.0 * moved * _STIFF_PER_S)
        ET.SubElement(servos, "position", name=name, joint=name, kp=kp, kv=kv)
        ET.SubElement(custom, "numeric", name=name, data=_numbers(course.tolist()))
    ET.SubElement(custom, "numeric", name="time_s", data=_numbers(lift.time_s.tolist()))
    first = {name: float(course[0]) for name, course in commands.items()}
    free = {f"{part}_{axis}": 0.0 for part in ("rope", "sling") for axis in "xy"}
    names = [joint.get("name", "") for joint in root.iter("joint") if joint.get("type")]
    start = {**first, **free, **{j.name: first[j.follows] for j in lift.links.joints if j.follows is not None}}
    keys = ET.SubElement(root, "keyframe")
    ctrl = _numbers(list(first.values()))
    ET.SubElement(keys, "key", name="begins", qpos=_numbers([start[name] for name in names]), ctrl=ctrl)


def _moved(lift: HungLoad, name: str, total_kg: float) -> float:
    """Return about what a servo moves: kg, or kg m² if it turns."""
    if name == "tag_line":
        return lift.load.moments_kg_m2[2]
    reach_m = lift.crane.jib_length_m
    if name in ("slewing", "luffing"):
        own = sum(inertia_of(lift.links.boxes.get(link, ())).mass_kg for link in ("platform", "jib", "trolley"))
        return total_kg * reach_m**2 + own * reach_m**2 / 3.0
    trolley_kg = inertia_of(lift.links.boxes.get("trolley", ())).mass_kg
    return total_kg + (trolley_kg if name == "trolley" else 0.0)


def _numbers(values: Sequence[float]) -> str:
    return " ".join(_number(value) for value in values)


def _number(value: float) -> str:
    return f"{value:.9g}"
