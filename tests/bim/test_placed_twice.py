"""Models that are placed on the map by their geometry and by their map conversion."""

from __future__ import annotations

import math

import pytest

from bimvox.bim.site_frame import is_about_place, placed_twice

FAR = {"eastings_m": 155_000.0, "northings_m": 463_000.0, "height_m": 3.0}


@pytest.mark.parametrize(
    ("georeference", "middle_m"),
    [
        (FAR, (155_010.0, 463_005.0, 4.0)),
        ({**FAR, "x_axis_yaw_rad": math.pi}, (155_010.0, 463_005.0, 4.0)),
        ({**FAR, "x_axis_yaw_rad": 0.4, "scale": 0.9996}, (154_000.0, 470_000.0, 0.0)),
        ({"eastings_m": 33_311_988.0, "northings_m": 5_996_148.0, "height_m": 0.0}, (311_988.0, 5_996_148.0, 12.0)),
    ],
)
def test_far_geometry_that_is_moved_far_again_is_noted(georeference, middle_m):
    note = placed_twice(georeference, middle_m)
    assert note is not None
    assert is_about_place(note)
    assert f"({middle_m[0]:,.1f}, {middle_m[1]:,.1f}) m" in note
    assert f"({georeference['eastings_m']:,.1f}, {georeference['northings_m']:,.1f}) m" in note


@pytest.mark.parametrize(
    ("georeference", "middle_m"),
    [
        ({}, (155_010.0, 463_005.0, 4.0)),  # no conversion
        ({"crs": "EPSG:28992"}, (155_010.0, 463_005.0, 4.0)),
        (FAR, (10.0, 5.0, 4.0)),  # local geometry
        (FAR, (-900.0, 8_000.0, 4.0)),
        ({"eastings_m": 0.0, "northings_m": 0.0, "height_m": 3.2}, (155_010.0, 463_005.0, 4.0)),  # only a height
        ({"eastings_m": -155_000.0, "northings_m": -463_000.0, "height_m": 0.0}, (155_010.0, 463_005.0, 4.0)),  # back
    ],
)
def test_a_model_that_is_placed_once_is_not(georeference, middle_m):
    assert placed_twice(georeference, middle_m) is None
