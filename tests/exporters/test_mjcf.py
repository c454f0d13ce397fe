"""One lift as a MuJoCo model: what it holds, and that its load swings as the plan says, in MuJoCo and without it."""

import xml.etree.ElementTree as ET

import numpy as np
import pytest
from double_pendulum import Load, left_m
from two_cranes import two_crane_plan

from bimvox.crane.kinematics import axes_of_joints
from bimvox.errors import InputError
from bimvox.exporters.hung_load import hung_load_of, inertia_of
from bimvox.exporters.log import WRITERS, Chosen
from bimvox.exporters.mjcf import mjcf
from bimvox.exporters.urdf import urdf
from bimvox.log.plan_log import PlanLog
from bimvox.motion.swing import pendulum_on, swing_of

_SAME_M = 0.05
_STEP_S = 0.02


@pytest.fixture(scope="module")
def log():
    plan, motions = two_crane_plan()
    return PlanLog(plan=plan, motions=motions, attachments={}, metadata={})


def numbers(root, name):
    (found,) = (one.get("data") for one in root.iter("numeric") if one.get("name") == name)
    return np.array(found.split(), float)


def offsets_m(log, lift, order):
    """Return times and (N, 2) how far the plan says that the load is from below the rope's exit."""
    motion = next(one for one in log.motions if one.order == order)
    at_s = np.arange(0.0, lift.time_s[-1], _STEP_S)
    axes = np.stack([np.interp(at_s, lift.time_s, course) for course in motion.loaded.axes.T], axis=1)
    site = log.plan.site
    pendulum = pendulum_on(site, lift.crane, site.components[motion.component])
    return at_s, swing_of(lift.crane, axes, _STEP_S, pendulum).offset_m


def test_a_model_has_the_masses_and_the_commands_of_its_lift(log):
    lift = hung_load_of(log, [2])
    root = ET.fromstring(mjcf(lift))
    masses = {body.get("name"): float(body.find("inertial").get("mass")) for body in root.iter("body")}
    assert masses["load"] == pytest.approx(lift.load_kg)
    assert masses["hook"] == pytest.approx(lift.block_kg)
    assert all(mass > 0 for mass in masses.values())
    motion = next(one for one in log.motions if one.order == 2)
    joints = np.stack([numbers(root, name) for name in ("slewing", "trolley", "hoist")], axis=1)
    np.testing.assert_allclose(axes_of_joints(lift.crane, joints), motion.loaded.axes, atol=1e-6)
    np.testing.assert_allclose(numbers(root, "tag_line"), -joints[:, 0])
    names = [joint.get("name") for joint in root.find("worldbody").iter("joint")]
    assert names == ["slewing", "trolley", "rope_x", "rope_y", "hoist", "sling_x", "sling_y", "tag_line"]
    begins = root.find("keyframe/key")
    first = dict(zip(names, map(float, begins.get("qpos").split()), strict=True))
    assert [first[name] for name in ("slewing", "trolley", "hoist")] == pytest.approx(joints[0].tolist())


def test_the_load_of_a_model_comes_to_rest(log):
    """By the pendulum of an observer who knows the file alone."""
    lift = hung_load_of(log, [2])
    root = ET.fromstring(mjcf(lift))
    masses = {body.get("name"): float(body.find("inertial").get("mass")) for body in root.iter("body")}
    below_m = -float(next(one for one in root.iter("site")).get("pos").split()[2])
    joints = np.stack([numbers(root, name) for name in ("slewing", "trolley", "hoist")], axis=1)
    load = Load(below_m, masses["hook"], masses["load"])
    assert left_m(lift.crane, numbers(root, "time_s"), axes_of_joints(lift.crane, joints), [(load, 1.0)])[0] < _SAME_M


def test_a_lift_replayed_in_mujoco_swings_as_the_plan_says(log):
    mujoco = pytest.importorskip("mujoco", reason="a simulator of the reader's")
    lift = hung_load_of(log, [2])
    model = mujoco.MjModel.from_xml_string(mjcf(lift).decode())
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    time_s = model.numeric("time_s").data
    commands = [model.numeric(model.actuator(n).name).data for n in range(model.nu)]
    at_s, offset_m = [], []
    while data.time < time_s[-1] + 10.0:
        data.ctrl[:] = [np.interp(data.time, time_s, course) for course in commands]
        mujoco.mj_step(model, data)
        at_s.append(data.time)
        offset_m.append((data.site("load").xpos - data.body("rope").xpos)[:2])
    at_s, offset_m = np.array(at_s), np.array(offset_m)
    planned_s, planned_m = offsets_m(log, lift, 2)
    assert np.abs(planned_m).max() > _SAME_M  # it swings on the way
    late_s = 0.02
    stated = np.stack([np.interp(at_s - late_s, planned_s, planned_m[:, n]) for n in (0, 1)], axis=1)
    under_way = at_s < time_s[-1]
    assert np.hypot(*(offset_m - stated)[under_way].T).max() < _SAME_M
    assert np.hypot(*offset_m[~under_way].T).max() < _SAME_M


def test_a_robot_has_inertia_rope_and_load(log):
    lift = hung_load_of(log, [2])
    robot = ET.fromstring(urdf(lift))
    links = {link.get("name"): link for link in robot.findall("link")}
    joints = {joint.get("name"): joint for joint in robot.findall("joint")}
    assert {"rope", "rope_fork", "sling_fork", "load"} <= set(links)
    assert {"rope_x", "rope_y", "sling_x", "sling_y"} <= set(joints)
    assert all(link.find("inertial") is not None for name, link in links.items() if name != "site")
    assert float(links["load"].find("inertial/mass").get("value")) == pytest.approx(lift.load_kg)
    parents = {joint.find("child").get("link"): joint.find("parent").get("link") for joint in joints.values()}
    way = ["load"]
    while way[-1] in parents:
        way.append(parents[way[-1]])
    assert way == [
        "load", "sling_fork", "hook", "rope", "rope_fork", "trolley", "jib", "crane_base", "site",
    ]  # fmt: skip


def test_the_inertia_of_two_boxes_is_that_of_their_masses_apart():
    from bimvox.crane.links import Box

    low, high = ((-0.5, -0.5, -0.5), (0.5, 0.5, 0.5))
    one = inertia_of([Box("one", low, high, "concrete")])
    assert one.mass_kg == pytest.approx(2_400.0)
    assert one.moments_kg_m2 == pytest.approx((400.0, 400.0, 400.0))
    moved = [tuple(np.add(corner, (4.0, 0.0, 0.0))) for corner in (low, high)]
    two = inertia_of([Box("one", low, high, "concrete"), Box("two", *moved, "concrete")])
    assert two.centre_m == pytest.approx((2.0, 0.0, 0.0))
    assert two.moments_kg_m2 == pytest.approx((800.0, 800.0 + 2 * 2_400 * 4.0, 800.0 + 2 * 2_400 * 4.0))


@pytest.mark.parametrize("name", ["mjcf", "urdf"])
def test_these_formats_are_of_one_lift(log, name):
    with pytest.raises(InputError, match="2 lifts are chosen, and this format is of one"):
        WRITERS[name](Chosen(log, (1, 2), begins=None))
    assert WRITERS[name](Chosen(log, (1,), begins=None)).startswith(b"<?xml")
