from __future__ import annotations

import io
import re

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

from bimvox.rendering.pictures.plots import LINES, Axis, Series, bytes_of, draw_histogram
from bimvox.rendering.report.plan_figures import draw_path_ratios, draw_utilisation


def lift(use: float | None, method: str = "policy", moves: int | None = 110) -> dict:
    return {"governs": {"utilisation": use}, "method": method, "moves": moves, "shortest_moves": moves and 100}


LIFTS = [lift(0.2), lift(0.4, "search", 100), lift(0.41), lift(0.9, "retrained", 190), lift(None, "policy", None)]


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[Figure]:
    """Collect the matplotlib figures, so that tests count bars instead of pixels."""
    figures: list[Figure] = []

    def kept(figure: Figure, file_format: str) -> bytes:
        figures.append(figure)
        return bytes_of(figure, file_format)

    monkeypatch.setattr("bimvox.rendering.pictures.plots.bytes_of", kept)
    return figures


def heights(figure: Figure) -> float:
    return sum(bar.get_height() for bar in figure.axes[0].patches)


def test_every_lift_is_counted_once(drawn):
    draw_utilisation(LIFTS, 0.75)
    draw_path_ratios(LIFTS)
    assert [heights(figure) for figure in drawn] == [4, 4]
    labels = [text.get_text() for text in drawn[1].axes[0].get_legend().get_texts()]
    assert labels[1:] == ["policy: 2 lifts", "policy, retrained: 1 lift", "search (A*): 1 lift"]
    assert labels[0] == f"all together {(110 + 100 + 110 + 190) / 400:.3f}"


def test_paths_of_greedy_values_are_named_in_words(drawn):
    draw_path_ratios([lift(0.2, "greedy")] * 3)
    labels = [text.get_text() for text in drawn[0].axes[0].get_legend().get_texts()]
    assert labels[1:] == ["towards the target: 3 lifts"]


def test_what_lies_beyond_the_ends_is_not_lost(drawn):
    draw_histogram([Series("", np.array([-5.0, 0.5, 7.0]))], Axis("x", 0.0, 1.0), counted="things")
    assert heights(drawn[0]) == 3


def test_series_stand_on_each_other_and_differ_without_colour(drawn):
    draw_histogram(
        [Series("a", np.array([1.0, 2.0])), Series("b", np.array([1.0, 2.0]))], Axis("x", bins=2), counted="n"
    )
    bars = drawn[0].axes[0].patches
    assert [bar.get_y() for bar in bars] == [0, 0, 1, 1]
    assert bars[0].get_hatch() != bars[2].get_hatch()


@pytest.mark.parametrize(
    "draw",
    [
        lambda kind: draw_utilisation(LIFTS, 0.75, file_format=kind),
        lambda kind: draw_path_ratios(LIFTS, file_format=kind),
    ],
)
def test_equal_figures_give_equal_bytes(draw):
    for kind in ("png", "svg"):
        assert draw(kind) == draw(kind)
    assert not re.search(rb"\d{4}-\d\d-\d\d", draw("svg"))


@pytest.mark.parametrize(
    "draw",
    [lambda: draw_utilisation([], 0.75), lambda: draw_path_ratios([])],
)
def test_nothing_to_count_is_an_empty_plot(draw):
    assert Image.open(io.BytesIO(draw())).format == "PNG"


def test_lines_stay_apart_in_gray():
    """Any two of the first four differ in lightness, or in dash and marker."""
    looks = {(str(line.dash), line.marker) for line in LINES}
    assert len(looks) == len(LINES)
