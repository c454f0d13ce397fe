"""Poses and steps of a part among triangles, compared with another collision library and with fine poses."""

import fcl
import numpy as np
import pytest
from box_sites import box_mesh

from bimvox.planning.contact.pairs import collision_object
from bimvox.planning.contact.posed import ALONG, LEVEL, UP, Group, meets, meets_between, posed


def soup(rng, count, size_m=0.1):
    """Return triangles all over a box of 2 m."""
    return rng.uniform(-1.0, 1.0, (count, 1, 3)) + rng.normal(0.0, size_m, (count, 3, 3))


def turned(pose):
    height, aside, tilt = pose
    cos, sin = np.cos(tilt), np.sin(tilt)
    return np.array([[cos, 0.0, -sin], [0.0, 1.0, 0.0], [sin, 0.0, cos]]), np.array([aside, 0.0, height])


def by_fcl(groups, pose):
    turn, at_m = turned(pose)
    for group in groups:
        part, other = collision_object(group.part_m), collision_object(group.other_m)
        part.setTransform(fcl.Transform(turn, at_m + group.aside_m))
        if fcl.collide(part, other):
            return True
    return False


@pytest.fixture(params=["soup", "boxes"])
def groups(request):
    rng = np.random.default_rng(5)
    aside_m = np.array([0.1, 0.0, 0.05])
    if request.param == "soup":
        part_m = soup(rng, 37)
        return [
            Group(part_m, soup(rng, 90) + np.array([1.9, 0.0, 0.0]), aside_m),
            Group(part_m, soup(rng, 5), np.zeros(3)),
        ]
    boxes = ((-2.0, 0.0, 0.0), (2.0, 1.0, 0.2)), ((2.2, 0.2, -1.0), (3.0, 1.2, 1.0)), ((1.8, 0.0, 0.6), (3.0, 1.0, 0.8))
    part_m, wall_m, shelf_m = (box_mesh(low, high).triangles_m for low, high in boxes)
    return [Group(part_m, wall_m, np.zeros(3)), Group(part_m, shelf_m, aside_m)]


def test_a_part_in_a_pose_meets_what_another_library_says(groups):
    shapes, rng = posed(groups), np.random.default_rng(1)
    poses = [tuple(pose) for pose in rng.uniform((0.0, -0.3, -0.2), (1.0, 0.3, 0.2), (300, 3)).tolist()]
    found = [meets(shapes, pose, LEVEL, 0.0) for pose in poses]
    assert 5 < sum(found) < 295
    assert found == [by_fcl(groups, pose) for pose in poses]
    backward = [meets(posed(groups), pose, LEVEL, 0.0) for pose in poses[::-1]]
    assert backward[::-1] == found, "what was met before does not matter"


@pytest.mark.parametrize("step", [ALONG, UP])
def test_a_step_from_a_free_pose_meets_what_a_fine_row_of_poses_meets(groups, step):
    shapes, rng = posed(groups), np.random.default_rng(2)
    steps, by_poses = [], []
    for height, aside, tilt in rng.uniform((0.0, -0.3, -0.2), (1.0, 0.3, 0.2), (300, 3)).tolist():
        start = (height, aside, tilt)
        if meets(shapes, start, LEVEL, 0.0):
            continue
        end = (height, aside + 0.1, tilt) if step == ALONG else (height + 0.1, aside, tilt)
        steps.append(meets(shapes, start, step, 0.1))
        by_poses.append(meets_between(shapes, start, end, 500))
    assert 3 < sum(steps) < len(steps) - 3
    assert steps == by_poses


def test_nothing_meets_nothing():
    assert not meets(posed([]), (0.0, 0.0, 0.0), LEVEL, 0.0)
    far = Group(np.zeros((1, 3, 3)), np.full((2, 3, 3), 9.0), np.zeros(3))
    assert not meets_between(posed([far]), (0.0, 0.0, 0.0), (1.0, 0.3, 0.2), 7)
