"""Measuring on the page: distances between corners are the log's, between typed points what was typed."""

from __future__ import annotations

import math

import numpy as np
import pytest
from log_building import tiny_log

pytestmark = pytest.mark.browser

PIXEL = """([x, y, z]) => {
  page._draw();
  const clip = page.camera.matrix(page.scene.radius);
  const [a, b, , w] = [0, 1, 2, 3].map((row) => clip[row] * x + clip[4 + row] * y + clip[8 + row] * z + clip[12 + row]);
  const box = document.querySelector("#canvas").getBoundingClientRect();
  const at = [((a / w + 1) / 2) * box.width, ((1 - b / w) / 2) * box.height];
  const frame = page._frame();
  const thing = page.scene.pick(frame, page.layers, Math.round(at[0] * frame.pixels), Math.round(at[1] * frame.pixels));
  return [box.left + at[0], box.top + at[1], thing ? thing.kind : null];
}"""


def told(seen):
    return seen.page.text_content("#measure output")


def test_the_distance_between_two_corners_is_that_of_the_log(seen):
    seen.page.keyboard.press("End")
    seen.page.keyboard.press("m")
    site = tiny_log().plan.site
    corners = np.unique(np.concatenate([part.mesh.vertices_m for part in site.components[:2]]), axis=0).tolist()
    found = []
    for corner in corners:
        x, y, kind = seen.page.evaluate(PIXEL, corner)
        if kind == "part":
            found.append((corner, x, y))
    assert len(found) >= 2, "no corner is in sight"
    (first, *one), (last, *other) = found[0], found[-1]
    seen.page.mouse.click(*one)
    before = seen.picture()
    seen.page.mouse.click(*other)
    assert seen.shows_other(before, by=40, pixels=50), "no line is drawn"
    measured = seen.page.evaluate("() => page.measure.points")
    every = np.concatenate([part.mesh.vertices_m for part in site.components])
    for point in measured:  # a corner of some part, to the step of the page's lattice
        assert np.abs(every - point).max(axis=1).min() < 0.01
    assert f"{math.dist(*measured):.2f} m" in told(seen)
    assert math.dist(*measured) == pytest.approx(math.dist(first, last), abs=0.35)
    assert seen.page.locator("#labels span").count() == 1
    seen.page.keyboard.press("m")
    seen.page.evaluate("() => page._draw()")
    assert seen.page.locator("#labels span").count() == 0


def test_points_are_typed_and_surfaces_and_ground_are_hit(seen):
    seen.page.keyboard.press("m")
    for n, values in enumerate([(0, 0, 0), (3, 4, 12)], start=1):
        for axis, value in zip("xyz", values, strict=True):
            seen.page.fill(f'[aria-label="Point {n}: {axis} in metres"]', str(value))
            seen.page.keyboard.press("Tab")
    assert "13.00 m" in told(seen)
    assert "on plan 5.00 m" in told(seen)
    seen.page.click("#measure-clear")
    assert "13.00" not in told(seen)
    box = seen.page.locator("#canvas").bounding_box()
    ground = seen.page.evaluate(
        """() => {
          const frame = page._frame();
          return [page.scene._groundAt(frame, frame.width / 2, frame.height / 2), page.scene.slab.high[2]];
        }"""
    )
    assert ground[0] is None or ground[0][2] == pytest.approx(ground[1], abs=1e-6)
    seen.page.mouse.click(box["x"] + 2, box["y"] + box["height"] - 2)
    assert seen.page.evaluate("() => page.measure.points[1]") is None
