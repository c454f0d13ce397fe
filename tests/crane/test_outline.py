import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest
from named_cranes import HAMMERHEADS, LUFFING_CRANES, MOBILE_CRANES, default_crane

from bimvox.crane.kinematics import hook_of, joint_names, joints_of
from bimvox.crane.links import links_of, urdf
from bimvox.crane.outline import outline_of


@pytest.mark.parametrize("crane", HAMMERHEADS, ids=lambda crane: crane.name)
def test_it_is_one_tree_of_known_links(crane):
    robot = ET.fromstring(urdf(crane))
    links = [link.get("name") for link in robot.findall("link")]
    children = [joint.find("child").get("link") for joint in robot.findall("joint")]
    parents = [joint.find("parent").get("link") for joint in robot.findall("joint")]
    assert links == ["site", "crane_base", "jib", "trolley", "hook"]
    assert set(links) - set(children) == {"site"}
    assert set(parents) <= set(links)
    assert len(children) == len(set(children)) == len(links) - 1
    moving = {joint.get("name"): joint for joint in robot.findall("joint") if joint.get("type") != "fixed"}
    assert tuple(moving) == joint_names(crane)
    assert [joint.get("type") for joint in moving.values()] == ["continuous", "prismatic", "prismatic"]


def test_numbers_are_the_cranes():
    crane = default_crane("hammerhead-45", (3.0, -4.0, 0.25), 31.25)
    robot = ET.fromstring(urdf(crane))
    by_name = {joint.get("name"): joint for joint in robot.findall("joint")}
    assert by_name["site_to_crane_base"].find("origin").get("xyz") == "3 -4 0.25"
    assert by_name["slewing"].find("origin").get("xyz") == "0 0 31"
    trolley = by_name["trolley"].find("limit")
    assert (float(trolley.get("lower")), float(trolley.get("upper"))) == (crane.min_radius_m, crane.jib_length_m)
    assert float(trolley.get("velocity")) == pytest.approx(crane.trolley.rate)
    assert by_name["hoist"].find("axis").get("xyz") == "0 0 -1"
    boxes = {shape.get("name") for shape in robot.iter("visual")}
    moved = {"ring", "cab", "jib", "counter_jib", "counterweight", "trolley", "hook"}
    assert boxes == {"foot", "mast"} | moved


def _hook_by_urdf(robot: ET.Element, values: dict[str, float]) -> np.ndarray:
    """Return the pose of the hook by following the joints from the site."""
    at = np.eye(4)
    joints = {joint.find("child").get("link"): joint for joint in robot.findall("joint")}
    chain, link = [], "hook"
    while link != "site":
        chain.append(joints[link])
        link = joints[link].find("parent").get("link")
    for joint in reversed(chain):
        step = np.eye(4)
        step[:3, 3] = [float(value) for value in joint.find("origin").get("xyz").split()]
        at = at @ step
        mimic = joint.find("mimic")
        value = values[mimic.get("joint")] if mimic is not None else values.get(joint.get("name"), 0.0)
        if joint.get("type") == "fixed":
            continue
        axis = np.array([float(n) for n in joint.find("axis").get("xyz").split()])
        move = np.eye(4)
        if joint.get("type") == "prismatic":
            move[:3, 3] = axis * value
        else:
            x, y, z = axis
            cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
            move[:3, :3] = np.eye(3) + np.sin(value) * cross + (1 - np.cos(value)) * cross @ cross
        at = at @ move
    return at


@pytest.mark.parametrize("crane", [HAMMERHEADS[0], *LUFFING_CRANES, *MOBILE_CRANES], ids=lambda crane: crane.name)
def test_the_robot_puts_its_hook_where_the_crane_does(crane):
    crane = replace(crane, base_m=(3.0, -4.0, 0.25))
    axes = np.array([[0.7, 0.5 * (crane.min_radius_m + crane.jib_length_m), 4.0]])
    values = dict(zip(joint_names(crane), joints_of(crane, axes)[0].tolist(), strict=True))
    hook = _hook_by_urdf(ET.fromstring(urdf(crane)), values)
    assert hook[:3, 3] == pytest.approx(hook_of(crane, *axes.T)[0], abs=1e-6)
    assert hook[:3, 2] == pytest.approx([0.0, 0.0, 1.0], abs=1e-9)


@pytest.mark.parametrize("crane", HAMMERHEADS, ids=lambda crane: crane.name)
def test_the_strips_of_the_separation_contain_jib_and_counter_jib(crane):
    outline, jib_m = outline_of(crane), crane.jib_height_m
    solids = {box.name: box for boxes in links_of(crane).boxes.values() for box in boxes}
    for name, reach_m, half_m, (low_m, high_m) in (
        ("jib", outline.jib_end_m, outline.jib_half_m, outline.jib_m),
        ("counter_jib", outline.tail_m, outline.tail_half_m, outline.tail_height_m),
    ):
        box = solids[name]
        assert max(-box.low_m[0], box.high_m[0]) <= reach_m
        assert max(-box.low_m[1], box.high_m[1]) <= half_m
        assert low_m <= jib_m + box.low_m[2]
        assert jib_m + box.high_m[2] <= high_m
