from __future__ import annotations

import numpy as np
from box_sites import test_crane as crane_of
from hypothesis import given
from hypothesis import strategies as st

from bimvox.crane.tower_crane import CranePose
from bimvox.rendering.page.crane import FIXED, HOOK, SLEWING, crane_record
from bimvox.rendering.page.geometry import Blob
from bimvox.rendering.pictures.cranes import crane_parts


def posed(crane, points, joints, pose) -> np.ndarray:
    """Return what the page computes: rotate by the slew angle, move to the position of the joint."""
    cos, sin = np.cos(pose.slew_rad), np.sin(pose.slew_rad)
    turned = points @ np.array([[cos, sin, 0], [-sin, cos, 0], [0, 0, 1]])
    turned[joints == FIXED] = points[joints == FIXED]
    axis = np.array([crane.base_m[0], crane.base_m[1], 0.0])
    out = axis + pose.radius_m * np.array([cos, sin, 0])
    places = np.array([np.zeros(3), axis, out, out + np.array([0, 0, pose.height_m])])
    return turned + places[joints]


@given(st.floats(-7, 7), st.floats(3, 55), st.floats(1, 25))
def test_the_crane_of_joints_is_the_crane_of_pictures_in_every_pose(slew, radius, height):
    crane, pose = crane_of(base=(3.0, -2.0, 0.5)), CranePose(slew, radius, height)
    blob = Blob()
    record = crane_record(crane, blob)
    numbers = blob.to_bytes()
    points = np.frombuffer(numbers, "<f4", record["lines"]["points"][2], record["lines"]["points"][1]).reshape(-1, 3)
    joints = np.frombuffer(numbers, "u1", record["lines"]["joints"][2], record["lines"]["joints"][1])
    drawn = np.concatenate([stroke.segments_m for stroke in crane_parts(crane, pose).strokes]).reshape(-1, 3)
    np.testing.assert_allclose(posed(crane, points.astype(float), joints, pose), drawn, atol=1e-4)
    assert set(joints.tolist()) == set(range(HOOK + 1))
    centres = np.array([block["centre_m"] for block in record["blocks"]])
    owners = np.array([block["joint"] for block in record["blocks"]])
    drawn_blocks = crane_parts(crane, pose).blocks
    np.testing.assert_allclose(posed(crane, centres, owners, pose), [b.centre_m for b in drawn_blocks], atol=1e-4)
    assert {FIXED, SLEWING, HOOK} <= set(owners.tolist())
