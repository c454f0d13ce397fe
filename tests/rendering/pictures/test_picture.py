from __future__ import annotations

import numpy as np
import pytest
from drawn_plans import motions_by_hand, plan_by_hand

from bimvox.errors import InputError
from bimvox.grid.frame import GridFrame
from bimvox.rendering.colours import PAPER
from bimvox.rendering.pictures.annotate import annotate
from bimvox.rendering.pictures.camera import View
from bimvox.rendering.pictures.picture import PictureOptions, _halved, picture_of, png_of
from bimvox.rendering.pictures.plan import Instant, scene_of_plan
from bimvox.rendering.pictures.scene import Scene

SMALL = PictureOptions(size_px=(160, 100))


def box_scene(**more) -> Scene:
    solids = np.zeros((10, 10, 6), np.uint16)
    solids[:, :, 0] = 1
    solids[3:6, 3:7, 1:5] = 2
    palette = np.array([(0, 0, 0), (200, 200, 200), (20, 90, 200)], np.uint8)
    return Scene(GridFrame((0.0, 0.0, 0.0), 1.0), solids, palette, **more)


def test_the_same_scene_gives_the_same_bytes():
    plan = plan_by_hand(crane=True)
    motions = motions_by_hand(plan)
    scenes = [scene_of_plan(plan.site, plan.lifts, motions, Instant(1)) for _ in range(2)]
    first, second = (png_of(scene, SMALL) for scene in scenes)
    assert first == second
    assert first.startswith(b"\x89PNG")
    assert b"tIME" not in first
    assert b"tEXt" not in first


def test_what_lies_under_title_and_caption_fades():
    """The end of a long jib may leave the frame at the top; it does not cross the words."""
    black = np.zeros((200, 400, 3), np.uint8)
    assert (annotate(black, box_scene(title="Site", caption="3 parts"))[5, 300:] > 200).all()
    assert (annotate(black, box_scene())[5] == 0).all()


def test_the_picture_has_the_requested_size_and_a_flat_background():
    picture = picture_of(box_scene(), PictureOptions(size_px=(123, 77), annotated=False))
    assert picture.shape == (77, 123, 3)
    assert (picture[[0, 0, -1, -1], [0, -1, 0, -1]] == PAPER).all()


def test_an_empty_scene_is_an_error_that_says_so():
    empty = Scene(GridFrame((0.0, 0.0, 0.0), 1.0), np.zeros((3, 3, 3), np.uint16), np.zeros((1, 3), np.uint8))
    with pytest.raises(InputError, match="nothing to draw"):
        picture_of(empty, SMALL)


@pytest.mark.parametrize("size", [(8, 100), (100, 100_000)])
def test_a_size_that_cannot_be_is_refused(size):
    with pytest.raises(InputError, match="pixels"):
        PictureOptions(size_px=size)


def test_solids_of_one_colour_are_told_apart_by_an_edge():
    solids = np.ones((10, 10, 2), np.uint16)
    solids[5:] = 2
    palette = np.array([(0, 0, 0), (200, 200, 200), (200, 200, 200)], np.uint8)
    options = PictureOptions(size_px=(200, 160), view=View(-90.0, 80.0), annotated=False)
    frame = GridFrame((0.0, 0.0, 0.0), 0.01)
    picture = picture_of(Scene(frame, solids, palette), options)
    row = picture[80, 40:160, 0].astype(int)
    assert row.min() < 160
    assert np.median(row) > 180
    one = picture_of(Scene(frame, np.ones_like(solids), palette), options)
    assert one[80, 40:160, 0].min() > 180


def test_dark_solids_have_light_edges():
    palette = np.array([(0, 0, 0), (30, 30, 32)], np.uint8)
    solids = np.ones((4, 4, 4), np.uint16)
    picture = picture_of(
        Scene(GridFrame((0.0, 0.0, 0.0), 1.0), solids, palette), PictureOptions(size_px=(120, 120), annotated=False)
    )
    middle = picture[30:90, 58:62].max(axis=2)
    assert middle.max() > 1.5 * np.median(middle)


def test_words_are_drawn_only_on_request():
    scene = box_scene(title="A title", caption="and a caption")
    bare = picture_of(scene, PictureOptions(size_px=(320, 200), annotated=False))
    worded = picture_of(scene, PictureOptions(size_px=(320, 200)))
    top = worded[:30, :120].astype(int)
    assert (np.abs(top - PAPER).sum(axis=2) > 200).any()
    assert (bare[:5, :40] == PAPER).all()


def test_joining_cells_keeps_the_solid_that_fills_most():
    solids = np.zeros((4, 2, 3), np.uint16)
    solids[0, 0, 0] = 3
    solids[2:, :, :2] = 5
    solids[2, 0, 0] = 9
    joined = _halved(solids)
    assert joined.shape == (2, 1, 2)
    assert joined[:, 0, 0].tolist() == [3, 5]
    assert joined[:, 0, 1].tolist() == [0, 0]
