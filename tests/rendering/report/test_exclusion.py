"""Exclusion zones of loads, measured from the log."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import shapely
from log_building import tiny_log
from scipy.spatial.transform import Rotation

from bimvox.log.moving import tracks_of
from bimvox.rendering.report.site_plan import FALL_M, below_load, fall_distance_m, fall_zone, reach_of


@pytest.fixture(scope="module")
def log():
    return tiny_log(crane=True)


def placed(site, track):
    component = site.components[track.lift.component]
    points = component.mesh.vertices_m - np.array(site.frame.corner_of(component.target_vox))
    for corner, tilt in zip(track.corner_m, track.tilt, strict=True):
        yield Rotation(tilt).apply(points) + corner


def test_every_vertex_of_a_load_is_above_its_zone_at_every_sample(log):
    site = log.plan.site
    for track in tracks_of(log):
        zone = below_load(site, track)
        shapely.prepare(zone)
        for points in placed(site, track):
            assert shapely.contains_xy(zone, *points[:, :2].T).all()


def test_a_load_that_keeps_its_heading_gives_its_outline_not_a_circle(log):
    site = log.plan.site
    track = next(one for one in tracks_of(log) if np.allclose(one.tilt, one.tilt[0]))
    line = np.linspace([0.0, 0.0, 5.0], [30.0, 0.0, 5.0], len(track.time_ns))
    straight = dataclasses.replace(track, corner_m=line)
    vertices = site.components[track.lift.component].mesh.vertices_m
    (length, width), moved = np.ptp(vertices[:, :2], axis=0), 30.0
    assert below_load(site, straight).area == pytest.approx((length + moved) * width, rel=0.08)
    assert below_load(site, straight).area >= (length + moved) * width


def test_the_reach_of_a_falling_load_follows_from_its_height(log):
    site = log.plan.site
    track = next(one for one in tracks_of(log) if np.allclose(one.tilt, one.tilt[0]))
    component = site.components[track.lift.component]
    middle = component.mesh.bounds_m.mean(axis=0) - np.array(site.frame.corner_of(component.target_vox))
    base = (component.mesh.vertices_m - np.array(site.frame.corner_of(component.target_vox)))[:, 2].min()
    for height_m, distance_m in ((5.0, 4.0), (20.0, 7.0), (45.0, 8.5)):
        still = np.tile([0.0, 0.0, height_m - base], (len(track.time_ns), 1))
        zone = fall_zone(site, dataclasses.replace(track, corner_m=still))
        radius = reach_of(component) + distance_m
        edge = [shapely.Point(middle[:2]).distance(shapely.Point(at)) for at in zone.exterior.coords]
        assert radius - 0.01 <= min(edge) + 0.1
        assert max(edge) <= radius + 0.25 + 0.03
        assert zone.buffer(0.01).covers(below_load(site, dataclasses.replace(track, corner_m=still)))


def test_the_distance_is_the_table_s_and_never_falls():
    heights, distances = np.array(FALL_M).T
    np.testing.assert_array_equal(fall_distance_m(heights), distances)
    assert fall_distance_m(np.array([0.0, 3.0, 15.0])).tolist() == [4.0, 4.0, 5.5]
    assert (np.diff(fall_distance_m(np.linspace(0.0, 900.0, 500))) >= 0.0).all()
