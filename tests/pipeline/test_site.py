"""``bimvox init``: the site file, and the drawing next to it."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import pytest
from bimvox_pipeline.site import init

from bimvox.errors import FileError
from bimvox.progress import SilentProgress

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
