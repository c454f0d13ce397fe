import xml.etree.ElementTree as ET

import pytest

from bimvox.crane.defaults import DEFAULT_CRANES, default_crane
from bimvox.crane.urdf import JOINTS, urdf


@pytest.mark.parametrize("crane", DEFAULT_CRANES, ids=lambda crane: crane.name)
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
    assert tuple(moving) == JOINTS
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
    assert boxes == {"mast", "jib", "counter_jib", "counterweight", "trolley", "hook"}
