"""Pictures against stored ones, within a tolerance, because fonts and rounding differ slightly between machines.

``BIMVOX_GOLDEN=write pytest tests/rendering/test_golden.py`` writes them again; look at them before you commit.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from drawn_plans import motions_by_hand, plan_by_hand
from log_building import tiny_log
from PIL import Image

from bimvox.log.moving import tracks_of
from bimvox.rendering.pictures.blocked import scene_of_blocked
from bimvox.rendering.pictures.camera import View
from bimvox.rendering.pictures.film_scene import Film
from bimvox.rendering.pictures.picture import PictureOptions, picture_of, png_from_pixels
from bimvox.rendering.pictures.plan import Instant, scene_of_plan
from bimvox.rendering.pictures.scene import Scene
from bimvox.rendering.pictures.site import scene_of_site, view_of_site

GOLDEN = Path(__file__).parent / "golden"
MEAN_DIFFERENCE = 0.7
"""Mean difference of a channel, of 255; moving a part by a few cells gives more than 1."""


def site() -> Scene:
    return scene_of_site(plan_by_hand().site)


def under_way() -> Scene:
    plan = plan_by_hand()
    return scene_of_plan(plan.site, plan.lifts, moment=Instant(1))


def finished_with_crane() -> Scene:
    plan = plan_by_hand(crane=True)
    return scene_of_plan(plan.site, plan.lifts, motions_by_hand(plan))


def under_way_with_crane() -> Scene:
    plan = plan_by_hand(crane=True)
    return scene_of_plan(plan.site, plan.lifts, motions_by_hand(plan), Instant(2, 0.45))


def tipped_up() -> Scene:
    """From an animation: a column that hangs at an angle while it is tipped up."""
    log = tiny_log(crane=True)
    film = Film(log.plan.site, log.all_lifts, log.motions, tracks_of(log))
    track = film.tracks[0]
    turned = np.flatnonzero(np.abs(track.tilt[:, 3]) < 0.98)
    return film.scene(int(track.time_ns[turned[len(turned) // 2]]))


def blocked() -> Scene:
    plan = plan_by_hand(infeasible=("roof",))
    scene, _ = scene_of_blocked(plan.site, plan.lifts, plan.lifts[2:])
    return scene


@pytest.mark.parametrize("make", [site, under_way, finished_with_crane, under_way_with_crane, tipped_up, blocked])
def test_pictures_look_as_they_did(make: Callable[[], Scene]):
    scene = make()
    view = view_of_site(plan_by_hand().site)
    words = make is under_way_with_crane
    size = (320, 200) if words else (160, 100)
    pixels = picture_of(scene, PictureOptions(size_px=size, view=view, annotated=words))
    file = GOLDEN / f"{make.__name__}.png"
    if os.environ.get("BIMVOX_GOLDEN") == "write":
        file.write_bytes(png_from_pixels(pixels))
    stored = np.asarray(Image.open(file).convert("RGB"))
    assert stored.shape == pixels.shape
    assert np.abs(stored.astype(int) - pixels.astype(int)).mean() < MEAN_DIFFERENCE


def test_the_tolerance_detects_a_part_in_another_place():
    plan = plan_by_hand()
    options = PictureOptions(size_px=(160, 100), view=View(-30.0, 28.0), annotated=False)
    pictures = [
        picture_of(scene_of_plan(plan.site, plan.lifts, moment=Instant(1, share)), options).astype(int)
        for share in (0.5, 0.6)
    ]
    assert np.abs(pictures[0] - pictures[1]).mean() > MEAN_DIFFERENCE
