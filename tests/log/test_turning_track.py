"""The poses of a load that turns with the jib: its hook stays where it is, and its heading follows the joint angle."""

from __future__ import annotations

import numpy as np
import pytest
from planned_sites import planned
from turning_sites import turning_site

from bimvox.crane.kinematics import hook_of
from bimvox.log.track import crane_track
from bimvox.rendering.pictures.film_scene import rotation
from bimvox.site.component import turned_cells

BEAM = 2


@pytest.fixture(scope="module")
def turned():
    plan, motions = planned(turning_site())
    return plan, motions[BEAM], crane_track(plan.site, plan.lifts[BEAM], motions[BEAM])


def yaw_rad(track) -> np.ndarray:
    return np.unwrap(2.0 * np.arctan2(track.tilt[:, 2], track.tilt[:, 3]), period=4.0 * np.pi)


def test_its_heading_follows_the_jib_until_it_is_turned(turned):
    _, motion, track = turned
    start_ns, end_ns = motion.turned_ns
    left_ns = motion.start_ns + int(motion.loaded.time_ns[0])
    slew = np.interp(track.time_ns - motion.start_ns, motion.loaded.time_ns, motion.loaded.slew_rad)
    carried = (track.time_ns >= left_ns) & (track.time_ns <= start_ns)
    assert carried.sum() > 20
    np.testing.assert_allclose(yaw_rad(track)[carried], (slew - motion.loaded.slew_rad[0])[carried], atol=1e-9)
    np.testing.assert_allclose(yaw_rad(track)[track.time_ns < left_ns], 0.0, atol=1e-12)
    np.testing.assert_allclose(yaw_rad(track)[track.time_ns >= end_ns], 0.0, atol=1e-12)
    turning = (track.time_ns >= start_ns) & (track.time_ns <= end_ns)
    rates = np.diff(yaw_rad(track)[turning]) / np.diff(track.time_ns[turning] / 1e9)
    assert turning.sum() > 10
    np.testing.assert_allclose(rates, -np.pi / 2.0 / 30.0, rtol=1e-6)  # 30 s a quarter, back


def test_its_hook_hangs_above_the_same_point_of_it(turned):
    plan, motion, track = turned
    site, component = plan.site, plan.site.components[1]
    crane = site.cranes[0]
    arm_m = np.array([*(np.array(component.hook_line_vox[:2]) + 0.5), component.shape.size_vox[2]]) * 0.5
    times, axes = motion.samples()
    poses = np.stack([np.interp(track.time_ns, times, axis) for axis in axes.T], axis=1)
    below_m = hook_of(crane, *poses.T) - (0.0, 0.0, crane.sling_m)
    upright = track.time_ns >= motion.start_ns + int(motion.loaded.time_ns[0])
    held = np.array([c + rotation(q) @ arm_m for c, q in zip(track.corner_m, track.tilt, strict=True)])
    np.testing.assert_allclose(held[upright], below_m[upright], atol=1e-9)


def test_a_picture_of_the_load_has_its_cells_turned():
    component = turning_site().components[1]
    cells = turned_cells(component, 0.0)
    assert {tuple(c) for c in cells.tolist()} == {tuple(c) for c in component.shape.cells.tolist()}
    along = turned_cells(component, np.pi / 2.0)
    assert np.ptp(cells, axis=0).tolist() == [7, 1, 0]
    assert np.ptp(along, axis=0).tolist() == [1, 7, 0]
    assert 12 <= len(turned_cells(component, np.pi / 4.0)) <= 20
