"""Obstructions in coordinates of the site, the model and the map, stated and not stated."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from box_sites import box_mesh, box_site

from bimvox.bim.site_frame import turn_about_z
from bimvox.errors import ObstructionFileError
from bimvox.site.map_frame import ifc_to_map
from bimvox.site.obstructions.coordinates import Survey, in_site_frame, is_about_coordinates
from bimvox.site.obstructions.file import parse_obstructions
from bimvox.site.obstructions.obstruction_set import Box, Cylinder, Form, Obstruction, ObstructionSet, Points, Voxels
from bimvox.site.site import Site

MAP = {"eastings_m": 155_000.0, "northings_m": 463_000.0, "height_m": 3.2}
LOW, HIGH = (3.0, 7.5, 0.0), (4.0, 8.5, 2.0)
FORMS: dict[str, Form] = {
    "box": Box(LOW, HIGH),
    "cylinder": Cylinder((3.0, 7.5, 0.0), 0.5, 2.0),
    "mesh": box_mesh(LOW, HIGH),
    "points": Points(np.array([LOW, HIGH])),
}


def site(yaw_rad: float = 0.0, origin_m: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Site:
    """A site of 24 x 12 m whose model has other axes and another height."""
    found = box_site([("beam", (1.0, 1.0, 0.0), (4.0, 2.0, 1.0))], shape=(48, 24, 10))
    site_to_ifc = np.eye(4)
    site_to_ifc[:3, :3], site_to_ifc[:3, 3] = turn_about_z(yaw_rad), origin_m
    return replace(found, site_to_ifc=site_to_ifc)


def survey(yaw_rad: float = 0.0, coordinates: str = "site", **other: float) -> Survey:
    return Survey(ifc_to_map({**MAP, "x_axis_yaw_rad": yaw_rad, **other}, "m"), coordinates)  # type: ignore[arg-type]


def moved(form: Form, matrix: np.ndarray) -> Form:
    """The same thing, told in other coordinates that are only shifted."""
    by = matrix[:3, 3]
    match form:
        case Box(low_m, high_m):
            return Box(tuple(low_m + by), tuple(high_m + by))
        case Cylinder(base_m, radius_m, height_m):
            return Cylinder(tuple(base_m + by), radius_m, height_m)
        case Points(points_m):
            return Points(points_m + by)
    return replace(form, vertices_m=form.vertices_m + by)  # type: ignore[type-var, union-attr]


def bounds(form: Form) -> np.ndarray:
    match form:
        case Box(low_m, high_m):
            return np.array([low_m, high_m])
        case Cylinder(base_m, radius_m, height_m):
            return np.array(
                [np.subtract(base_m, [radius_m, radius_m, 0]), np.add(base_m, [radius_m, radius_m, height_m])]
            )
        case Points(points_m):
            return np.array([points_m.min(axis=0), points_m.max(axis=0)])
    return form.bounds_m  # type: ignore[union-attr]


def told(form: Form, coordinates: str | None) -> ObstructionSet:
    return replace(ObstructionSet.of([Obstruction("shed", form)]), coordinates=coordinates)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("stated", ["map", None])
@pytest.mark.parametrize("of_site", ["site", "map"])
def test_map_coordinates_are_followed_or_recognised(form, stated, of_site):
    to_map = np.array(survey().ifc_to_map)
    found = in_site_frame(told(moved(FORMS[form], to_map), stated), site(), survey(coordinates=of_site))
    np.testing.assert_allclose(bounds(found.obstructions[0].form), bounds(FORMS[form]), atol=1e-6)
    assert found.coordinates == "site"
    said = ("1 obstruction is read in map coordinates: far outside the site otherwise: 'shed'",)
    assert found.notes == (said if stated is None and of_site == "site" else ())
    assert all(map(is_about_coordinates, found.notes))


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("stated", ["site", None])
@pytest.mark.parametrize("of_site", ["site", "map"])
def test_site_coordinates_are_followed_or_recognised(form, stated, of_site):
    found = in_site_frame(told(FORMS[form], stated), site(), survey(coordinates=of_site))
    np.testing.assert_array_equal(bounds(found.obstructions[0].form), bounds(FORMS[form]))
    assert bool(found.notes) == (stated is None and of_site == "map")


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("known", [Survey(), survey()])
def test_coordinates_of_a_model_far_from_its_origin_are_recognised(form, known):
    far = site(origin_m=(90_000.0, 430_000.0, -1.0))
    found = in_site_frame(told(moved(FORMS[form], far.site_to_ifc), None), far, known)
    np.testing.assert_allclose(bounds(found.obstructions[0].form), bounds(FORMS[form]), atol=1e-6)
    assert "the model's coordinates" in found.notes[0]


@pytest.mark.parametrize("form", ["box", "mesh", "points"])
@pytest.mark.parametrize("yaw_deg", [30.0, 90.0, -123.0])
def test_a_turned_map_turns_the_obstruction(form, yaw_deg):
    here, known = site(0.3, (2.0, 1.0, 0.5)), survey(math.radians(yaw_deg), scale=0.9996)
    site_to_map = np.array(known.ifc_to_map) @ here.site_to_ifc
    corners = np.array([[x, y, z] for x in (3.0, 4.0) for y in (7.5, 8.5) for z in (0.0, 2.0)])
    on_map = (np.c_[corners, np.ones(8)] @ site_to_map.T)[:, :3]
    if form == "box":  # upright along the map's axes, so it is turned in the site
        low, high = on_map.min(axis=0), on_map.max(axis=0)
        given: Form = Box(tuple(low), tuple(high))
        on_map = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    else:
        given = Points(on_map) if form == "points" else replace(box_mesh(LOW, HIGH), vertices_m=on_map)
    found = in_site_frame(told(given, "map"), here, known).obstructions[0].form
    wanted = (np.c_[on_map, np.ones(8)] @ np.linalg.inv(site_to_map).T)[:, :3]
    np.testing.assert_allclose(bounds(found), [wanted.min(axis=0), wanted.max(axis=0)], atol=1e-5)
    if form == "box":
        volume_m3 = np.prod(high - low) / 0.9996**3
        assert found.signed_volume_m3 == pytest.approx(volume_m3, rel=1e-5)


def test_a_box_stays_one_if_the_map_is_turned_by_a_right_angle():
    known = survey(math.pi / 2)
    found = in_site_frame(told(Box((154_991.5, 463_003.0, 3.2), (154_992.5, 463_004.0, 5.2)), "map"), site(), known)
    assert found.obstructions[0].form == Box((3.0, 7.5, 0.0), (4.0, 8.5, 2.0))


def test_each_obstruction_is_recognised_by_itself_and_cells_stay():
    near, far = FORMS["box"], moved(FORMS["box"], np.array(survey().ifc_to_map))
    nowhere = Box((9e6, 0.0, 0.0), (9.1e6, 1.0, 1.0))
    every = [Obstruction(f"far {n}", far) for n in range(7)]
    every += [Obstruction("near", near), Obstruction("cells", Voxels(((99, 1, 1),))), Obstruction("nowhere", nowhere)]
    found = in_site_frame(replace(ObstructionSet.of(every), coordinates=None), site(), survey())
    forms = {one.id: one.form for one in found.obstructions}
    assert forms == {f"far {n}": near for n in range(7)} | {
        "near": near, "cells": Voxels(((99, 1, 1),)), "nowhere": nowhere,
    }  # fmt: skip
    assert found.notes[0].startswith("7 obstructions are read in map coordinates")
    assert found.notes[0].endswith("'far 0', 'far 1', 'far 2', 'far 3', 'far 4' and 2 more")


def test_a_map_close_to_the_site_is_never_guessed():
    local = survey(eastings_m=100.0, northings_m=200.0)
    outside = told(Box((103.0, 207.5, 3.2), (104.0, 208.5, 5.2)), None)
    assert in_site_frame(outside, site(), local).obstructions[0].form == outside.obstructions[0].form
    found = in_site_frame(outside, site(), replace(local, coordinates="map"))
    assert found.obstructions[0].form == Box((3.0, 7.5, 0.0), (4.0, 8.5, 2.0))


def test_a_model_with_its_own_map_conversion_is_placed_by_it():
    own = ifc_to_map({**MAP, "eastings_m": 155_002.0}, "m")
    mesh = told(box_mesh((1.0, 7.5, 0.0), (2.0, 8.5, 2.0)), None)
    found = in_site_frame(mesh, site(), survey(coordinates="model"), own_map=own)
    np.testing.assert_allclose(bounds(found.obstructions[0].form), [LOW, HIGH], atol=1e-6)


def test_map_coordinates_without_a_conversion_are_refused():
    with pytest.raises(ObstructionFileError, match="coordinates: the model has no map conversion"):
        in_site_frame(told(FORMS["box"], "map"), site(), Survey())


@pytest.mark.parametrize("unit", ["m", "mm", "ft"])
def test_a_file_states_coordinates_and_unit(unit):
    per_m = {"m": 1.0, "mm": 1000.0, "ft": 1 / 0.3048}[unit]
    box = {
        "min": [155_003.0 * per_m, 463_007.5 * per_m, 3.2 * per_m],
        "max": [155_004.0 * per_m, 463_008.5 * per_m, 9 * per_m],
    }
    entries = [{"id": "shed", "box": box}]
    data = json.dumps({"version": 1, "unit": unit, "coordinates": "map", "obstructions": entries}).encode()
    given = parse_obstructions(data, "mine.json", Path())
    assert given.coordinates == "map"
    (one,) = in_site_frame(given, site(), survey()).obstructions
    np.testing.assert_allclose(bounds(one.form), [LOW, (4.0, 8.5, 5.8)], atol=1e-5)
    with pytest.raises(ObstructionFileError, match="coordinates"):
        parse_obstructions(data.replace(b'"map"', b'"moon"'), "mine.json", Path())
