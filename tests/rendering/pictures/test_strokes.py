from __future__ import annotations

import numpy as np

from bimvox.grid.frame import GridFrame
from bimvox.rendering.pictures.camera import View
from bimvox.rendering.pictures.picture import PictureOptions, camera_of, picture_of
from bimvox.rendering.pictures.scene import Scene, Strokes, box_edges, polyline

RED = (255, 0, 0)
OPTIONS = PictureOptions(size_px=(200, 160), view=View(-90.0, 20.0), annotated=False)


def scene_with(strokes: Strokes | None, *, wall: bool) -> Scene:
    """Return the view from -y of a floor, a wall across its middle, and a line along x."""
    solids = np.zeros((20, 20, 10), np.uint16)
    solids[:, :, 0] = 1
    if wall:
        solids[:, 9:11, 1:8] = 2
    palette = np.array([(0, 0, 0), (200, 200, 200), (120, 160, 120)], np.uint8)
    return Scene(GridFrame((0.0, 0.0, 0.0), 1.0), solids, palette, (strokes,) if strokes else ())


def redness(scene: Scene) -> np.ndarray:
    picture = picture_of(scene, OPTIONS).astype(int)
    return picture[..., 0] - picture[..., 1]


def line(y: float, **more) -> Strokes:
    return Strokes(polyline([(3.0, y, 3.0), (17.0, y, 3.0)]), RED, width_px=12.0, **more)


def along(scene: Scene, y: float) -> np.ndarray:
    camera = camera_of(scene, OPTIONS)
    points = np.stack([np.linspace(4, 16, 60), np.full(60, y), np.full(60, 3.0)], axis=1)
    x, row = camera.project(points)[:, :2].T.astype(int)
    return redness(scene)[row, x]


def test_a_line_before_a_wall_is_drawn_whole():
    assert (along(scene_with(line(4.0), wall=True), 4.0) > 200).all()


def test_a_wall_hides_the_line_behind_it():
    assert (along(scene_with(line(15.0), wall=False), 15.0) > 200).all()
    assert (np.abs(along(scene_with(line(15.0), wall=True), 15.0)) < 60).all()


def test_the_hidden_part_is_dotted_and_faint_on_request():
    shown = along(scene_with(line(15.0, hidden_opacity=0.4), wall=True), 15.0)
    dots = shown > 40
    assert 0.2 < dots.mean() < 0.9
    assert shown.max() < 160


def test_opacity_does_not_add_up_within_one_stroke():
    there_and_back = Strokes(
        np.concatenate([polyline([(3.0, 4.0, 3.0), (17.0, 4.0, 3.0)])] * 5), RED, width_px=12.0, opacity=0.3
    )
    once = along(scene_with(line(4.0, opacity=0.3), wall=True), 4.0)
    np.testing.assert_allclose(along(scene_with(there_and_back, wall=True), 4.0), once, atol=1)


def test_a_line_out_of_the_picture_changes_nothing():
    far = Strokes(polyline([(400.0, 4.0, 3.0), (900.0, 4.0, 3.0)]), RED)
    np.testing.assert_array_equal(redness(scene_with(far, wall=True)), redness(scene_with(None, wall=True)))


def test_straight_runs_become_one_segment():
    points = [(0, 0, 0), (1, 0, 0), (2, 0, 0), (2, 1, 0), (2, 2, 0), (2, 1, 0)]
    assert polyline(points).tolist() == [
        [[0, 0, 0], [2, 0, 0]],
        [[2, 0, 0], [2, 2, 0]],
        [[2, 2, 0], [2, 1, 0]],
    ]


def test_a_box_has_twelve_edges():
    edges = box_edges((1, 2, 3), (4, 6, 8))
    lengths = np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1)
    assert sorted(lengths.tolist()) == [3.0] * 4 + [4.0] * 4 + [5.0] * 4
    assert len({tuple(sorted(map(tuple, edge))) for edge in edges.tolist()}) == 12
