"""``bimvox init``: the site file, and the drawing next to it."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import pytest
import trimesh
from bimvox_pipeline.site import init

from bimvox.bim.options import ReadOptions
from bimvox.bim.read import read_building
from bimvox.errors import FileError, SelectionError
from bimvox.progress import SilentProgress
from bimvox.site.config.file import load_site_config
from bimvox.site.guess import complete_config

MODEL = Path(__file__).parents[2] / "sample_models" / "frame.ifc"


@pytest.mark.parametrize(("given", "drawn"), [("a.site.toml", "a.site.svg"), ("a", "a.svg"), ("a.svg", "a.svg.svg")])
def test_the_drawing_is_next_to_the_site_file(tmp_path: Path, given: str, drawn: str) -> None:
    document = init(MODEL, tmp_path / given, progress=SilentProgress())
    assert document["drawing"] == str(tmp_path / drawn)
    assert ElementTree.parse(tmp_path / drawn).getroot().tag == "{http://www.w3.org/2000/svg}svg"
    assert {one.name for one in tmp_path.iterdir()} == {given, drawn}


def test_the_same_model_gives_the_same_bytes(tmp_path: Path) -> None:
    for name in "ab":
        (tmp_path / name).mkdir()
        init(MODEL, tmp_path / name / "frame.site.toml", progress=SilentProgress())
    assert (tmp_path / "a" / "frame.site.svg").read_bytes() == (tmp_path / "b" / "frame.site.svg").read_bytes()


def test_a_drawing_is_replaced_only_with_force(tmp_path: Path) -> None:
    site, drawn = tmp_path / "a.site.toml", tmp_path / "a.site.svg"
    drawn.write_text("mine")
    with pytest.raises(FileError, match="exists already") as refused:
        init(MODEL, site, progress=SilentProgress())
    assert refused.value.hint is not None
    assert "--force" in refused.value.hint
    assert not site.exists()
    assert drawn.read_text() == "mine"
    init(MODEL, site, force=True, progress=SilentProgress())
    assert drawn.read_bytes().startswith(b"<svg")


def test_heavy_walls_of_unknown_make_are_planned_with_the_line_that_is_told(tmp_path: Path) -> None:
    """It is a whole site file; no usual crane lifts them, so they are not taken as precast by themselves."""
    model, site = tmp_path / "hall.obj", tmp_path / "hall.site.toml"
    walls = {f"wall {n}": trimesh.creation.box((10.0, 0.35, 3.8)) for n in (1, 2)}
    for n, wall in enumerate(walls.values()):
        wall.apply_translation((0.0, 30.0 * n, 1.9))
    trimesh.Scene(walls).export(model)
    with pytest.raises(SelectionError, match="nothing to lift: no usual crane") as refused:
        init(model, site, options=ReadOptions(unit="m", up="z"), progress=SilentProgress())
    hint = refused.value.hint or ""
    assert f"bimvox plan {site}: model = " in hint
    site.write_text("model = " + hint.partition(": model = ")[2].partition("; otherwise")[0])
    config = load_site_config(site)
    building = read_building(model, ReadOptions(unit="m", up="z", corrections=config.corrections))
    assert complete_config(config, building).crane is not None
