from __future__ import annotations

import io

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

from benchmarks.plots import Growth, draw_latencies, draw_scaling
from bimvox.rendering.pictures.plots import bytes_of


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch) -> list[Figure]:
    """Collect the matplotlib figures, so that tests count bars instead of pixels."""
    figures: list[Figure] = []

    def kept(figure: Figure, file_format: str) -> bytes:
        figures.append(figure)
        return bytes_of(figure, file_format)

    for module in ("benchmarks.plots", "bimvox.rendering.pictures.plots"):
        monkeypatch.setattr(f"{module}.bytes_of", kept)
    return figures


def test_latencies_have_their_quantiles(drawn):
    draw_latencies([10.0, 20.0, 30.0, 1000.0], 500.0)
    labels = [text.get_text() for text in drawn[0].axes[0].get_legend().get_texts()]
    assert labels == [
        "median 25 ms",
        f"95 % below {np.quantile([10, 20, 30, 1000], 0.95):.0f} ms",
        "wanted below 500 ms",
    ]
    assert drawn[0].axes[0].get_xscale() == "log"
    assert sum(bar.get_height() for bar in drawn[0].axes[0].patches) == 4


def test_the_exponent_of_growth():
    size = np.array([1.0, 2.0, 4.0, 8.0])
    assert Growth("a", size, 3.0 * size**1.5).exponent == pytest.approx(1.5)
    assert np.isnan(Growth("a", np.array([2.0, 2.0]), np.array([1.0, 3.0])).exponent)


def test_scaling_says_its_exponent(drawn):
    size = np.array([1.0, 10.0, 100.0])
    picture = draw_scaling([Growth("plan", size, size**2), Growth("one", size[:1], size[:1])], size="parts", value="s")
    assert Image.open(io.BytesIO(picture)).format == "PNG"
    labels = [text.get_text() for text in drawn[0].axes[0].get_legend().get_texts()]
    assert labels == ["plan  ~ size^2.00", "one"]


def test_no_latencies_are_an_empty_plot():
    assert Image.open(io.BytesIO(draw_latencies([], 500.0))).format == "PNG"
