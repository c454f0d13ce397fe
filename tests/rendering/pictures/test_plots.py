from __future__ import annotations

import io

import numpy as np
import pytest
from PIL import Image

from bimvox.rendering.pictures.plots import LINES, Bar, Curve, Panel, draw_bars, draw_success_curves


def curve(label: str, rate: float) -> Curve:
    steps = np.arange(0.0, 10_001.0, 2_000.0)
    mean = np.linspace(0.0, rate, steps.size)
    return Curve(label, steps, mean, np.clip(mean - 0.1, 0, 1), np.clip(mean + 0.1, 0, 1))


def pixels(data: bytes) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(data)).convert("RGB")).astype(int)


def has_colour(data: bytes, line: int) -> bool:
    rgb = [int(LINES[line].colour[n : n + 2], 16) for n in (1, 3, 5)]
    return bool((np.abs(pixels(data) - rgb).max(axis=2) < 12).any())


@pytest.mark.parametrize("file_format", ["png", "svg"])
def test_equal_figures_give_equal_bytes(file_format):
    panels = [Panel("(a)", (curve("paper", 1.0), curve("ours", 0.8)))]
    bars = [Bar("g", "s", 2.0, 1.0, 3.0), Bar("g", "t", 20.0, 20.0, 20.0, censored=True)]
    for draw in (
        lambda: draw_success_curves(panels, file_format=file_format),
        lambda: draw_bars(bars, axis="steps", file_format=file_format),
    ):
        assert draw() == draw()


def test_the_look_does_not_depend_on_the_callers_settings():
    import matplotlib as mpl

    panels = [Panel("(a)", (curve("paper", 1.0),))]
    expected = draw_success_curves(panels)
    with mpl.rc_context({"axes.facecolor": "red", "font.size": 20}):
        assert draw_success_curves(panels) == expected
        assert mpl.rcParams["font.size"] == 20


def test_each_series_has_its_colour_in_every_panel():
    one = draw_success_curves([Panel("(a)", (curve("paper", 1.0),))])
    assert has_colour(one, 0)
    assert not has_colour(one, 1)
    second_alone = draw_success_curves(
        [Panel("(a)", (curve("paper", 1.0), curve("ours", 1.0))), Panel("(b)", (curve("ours", 0.5),))]
    )
    right = pixels(second_alone)[:, pixels(second_alone).shape[1] // 2 :]
    rgb = [int(LINES[1].colour[n : n + 2], 16) for n in (1, 3, 5)]
    assert (np.abs(right - rgb).max(axis=2) < 12).any()


def test_a_panel_without_curves_says_why():
    blank = draw_success_curves([Panel("(d)", ())])
    noted = draw_success_curves([Panel("(d)", (), "the loaded policy solves it")])
    assert pixels(noted).sum() < pixels(blank).sum()


def test_a_censored_bar_is_drawn_open():
    closed = draw_bars([Bar("g", "s", 2.0, 2.0, 2.0)], axis="steps")
    opened = draw_bars([Bar("g", "s", 2.0, 2.0, 2.0, censored=True)], axis="steps")
    rgb = [int(LINES[0].colour[n : n + 2], 16) for n in (1, 3, 5)]
    filled = [(np.abs(pixels(data) - rgb).max(axis=2) < 12).sum() for data in (closed, opened)]
    assert filled[1] < filled[0] / 10
