"""The drawing of a site from above, by ``bimvox render``."""

from __future__ import annotations

import json
import re
import shutil
import sys
from io import BytesIO
from pathlib import Path

import pytest
from bimvox_pipeline.browser import BROWSERS
from bimvox_pipeline.render.render import render
from bimvox_pipeline.render.scene import SceneOptions
from bimvox_pipeline.site import init
from PIL import Image

from bimvox.errors import BimvoxError, InputError
from bimvox.progress import SilentProgress

MODEL = Path(__file__).parents[3] / "sample_models" / "frame.ifc"
ABOVE = SceneOptions(elevation_deg=90.0)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("site") / "frame.site.toml"
    init(MODEL, path, progress=SilentProgress())
    return path


@pytest.mark.parametrize("options", [SceneOptions(), ABOVE])
def test_it_is_the_drawing_of_init(site: Path, tmp_path: Path, options: SceneOptions) -> None:
    document = render(site, tmp_path / "a.svg", shown=options, progress=SilentProgress())
    assert (tmp_path / "a.svg").read_bytes() == site.with_suffix(".svg").read_bytes()
    assert document["out"] == str(tmp_path / "a.svg")


def test_it_shows_the_crane_where_the_edited_file_says(site: Path, tmp_path: Path) -> None:
    edited = tmp_path / "b.site.toml"
    text = re.sub(r"(?m)^path = .*$", f"path = {json.dumps(str(MODEL))}", site.read_text())
    edited.write_text(re.sub(r"(?m)^base_m = .*$", "base_m = [-7.5, -6.25]", text))
    render(edited, tmp_path / "b.svg", progress=SilentProgress())
    assert "at (-7.50, -6.25)" in (tmp_path / "b.svg").read_text()


def test_without_a_browser_a_picture_is_refused_with_the_way_out(
    site: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("BIMVOX_BROWSER", "")
    monkeypatch.setattr("bimvox_pipeline.browser.BROWSERS", ())
    monkeypatch.setattr("bimvox_pipeline.browser._MAC", ())
    with pytest.raises(InputError, match=r"a picture of the drawing needs Chromium") as refused:
        render(site, tmp_path / "a.png", shown=ABOVE, progress=SilentProgress())
    assert ".svg" in str(refused.value.hint)


@pytest.mark.skipif(sys.platform == "win32", reason="a script stands for the browser")
def test_a_browser_that_fails_leaves_no_file(site: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("BIMVOX_BROWSER", "false")
    with pytest.raises(BimvoxError, match="made no file"):
        render(site, tmp_path / "a.png", shown=ABOVE, progress=SilentProgress())
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(not any(map(shutil.which, BROWSERS)), reason="no browser is installed")
@pytest.mark.parametrize("size", [None, (320, 200)])
def test_a_browser_draws_it_as_a_picture(site: Path, tmp_path: Path, size: tuple[int, int] | None) -> None:
    render(site, tmp_path / "a.png", shown=ABOVE, size=size, progress=SilentProgress())
    image = Image.open(BytesIO((tmp_path / "a.png").read_bytes()))
    assert image.size == size if size else image.width > 1200
    colours = image.convert("RGB").getcolors(1 << 24)
    assert colours is not None
    assert len(colours) > 20


@pytest.mark.parametrize(
    ("options", "named"),
    [
        (SceneOptions(hide=("crane",)), "--hide"),
        (SceneOptions(azimuth_deg=0.0), "--azimuth"),
        (SceneOptions(elevation_deg=45.0), "--elevation"),
        (SceneOptions(focus="beam"), "--focus"),
    ],
)
def test_options_of_other_views_are_refused(site: Path, tmp_path: Path, options: SceneOptions, named: str) -> None:
    with pytest.raises(InputError, match=f"has no {named}"):
        render(site, tmp_path / "a.svg", shown=options, progress=SilentProgress())


def test_only_a_site_has_a_drawing_from_above(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="only a site file is drawn as SVG"):
        render(MODEL, tmp_path / "a.svg", progress=SilentProgress())
