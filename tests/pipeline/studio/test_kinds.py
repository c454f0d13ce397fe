"""What the parts are, corrected in the studio: by type and by part, through the save that everything goes through."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest
from bimvox_pipeline.inspect.inspect import inspect
from bimvox_pipeline.studio.app import Studio

from bimvox.errors import BimvoxError
from bimvox.progress import SilentProgress
from bimvox.site.config.file import load_site_config
from bimvox.site.config.site_config import KindConfig

SAMPLES = Path(__file__).parents[3] / "sample_models"
BEAMS = "IfcBeam"
HEAD = """# my site
[model]
path = "frame.ifc"   # the model
voxel_size_m = 0.5
kinds = [
  # { select = 'IfcColumn', kind = "steel" },  # ASSUMED
]
[areas]
yard = [[[-2, -12], [14, -12], [14, -3], [-2, -3]]]
construction = [[-2, -2], [10, -2], [10, 9], [-2, 9]]
[crane]
base_m = [-6, -4]
machine = "flat-top-155"
"""


@pytest.fixture
def studio(tmp_path: Path) -> Studio:
    shutil.copy(SAMPLES / "frame.ifc", tmp_path)
    (tmp_path / "a.site.toml").write_text(HEAD)
    return Studio(tmp_path, "token")


def opened(studio: Studio, path: str = "a.site.toml") -> dict[str, Any]:
    return studio.open({"path": path})


def save(studio: Studio, path: str = "a.site.toml", **changes: Any) -> list[str]:
    found = opened(studio, path)
    asked = {"path": path, "setup": {**found["setup"], **changes}, "sha256": found["sha256"]}
    changed: list[str] = studio.save(asked)["changed"]
    return changed


def test_the_rows_are_those_of_inspect(studio: Studio, tmp_path: Path) -> None:
    assert opened(studio)["kinds"] == inspect(tmp_path / "a.site.toml", SilentProgress())["kinds"]


def test_a_type_is_corrected_among_the_comments_and_its_parts_are_read_again(studio: Studio, tmp_path: Path) -> None:
    timber = {"select": BEAMS, "kind": "timber", "means": None}
    assert save(studio, kinds=[timber]) == ["model.kinds"]
    text = (tmp_path / "a.site.toml").read_text()
    assert (
        "  # { select = 'IfcColumn', kind = \"steel\" },  # ASSUMED\n  {select = 'IfcBeam', kind = \"timber\"},\n]"
        in text
    )
    assert 'path = "frame.ifc"   # the model' in text
    after = opened(studio)
    assert after["setup"]["kinds"] == [timber]
    assert {row["kind"] for row in after["kinds"] if row["ifc_class"] == "IfcBeam"} == {"timber"}
    part = next(one for one in after["parts"] if one["class"] == "IfcBeam")
    assert (part["kind"], part["kind_from"]) == ("timber", "the site file says so")
    other = {"select": "IfcColumn", "kind": None, "means": "in_situ"}
    assert save(studio, kinds=[{**timber, "kind": None, "means": "crane"}, other]) == ["model.kinds"]
    wanted = (KindConfig(select=BEAMS, means="crane"), KindConfig(select="IfcColumn", means="in_situ"))
    assert load_site_config(tmp_path / "a.site.toml").model.kinds == wanted
    assert save(studio, kinds=[]) == ["model.kinds"]
    assert not load_site_config(tmp_path / "a.site.toml").model.kinds


@pytest.mark.slow
def test_one_part_is_corrected(studio: Studio, tmp_path: Path) -> None:
    part = opened(studio)["parts"][0]
    assert save(studio, part_kinds={part["id"]: "steel"}) == ["component[0].kind"]
    found = opened(studio)
    assert found["setup"]["part_kinds"] == {part["id"]: "steel"}
    assert found["parts"][0]["kind"] == "steel"
    assert save(studio, part_kinds={part["id"]: "timber"}) == ["component[0].kind"]
    assert load_site_config(tmp_path / "a.site.toml").component[0].kind == "timber"


@pytest.mark.slow
def test_a_file_of_kinds_stays_and_a_change_of_it_is_seen(studio: Studio, tmp_path: Path) -> None:
    table = tmp_path / "kinds.csv"
    table.write_text("set_kind,set_means,select\nsteel,,IfcColumn\n")
    (tmp_path / "a.site.toml").write_text(HEAD.replace("kinds = [\n", 'kinds = [\n  "kinds.csv",\n'))
    save(studio, kinds=[{"select": BEAMS, "kind": "timber", "means": None}])
    assert load_site_config(tmp_path / "a.site.toml").model.kinds == (
        "kinds.csv",
        KindConfig(select=BEAMS, kind="timber"),
    )
    kinds = {part["class"]: part["kind"] for part in opened(studio)["parts"]}
    assert kinds == {"IfcBeam": "timber", "IfcColumn": "steel"}
    table.write_text("set_kind,set_means,select\nmasonry,crane,IfcColumn\n")
    assert {part["kind"] for part in opened(studio)["parts"] if part["class"] == "IfcColumn"} == {"masonry"}


def test_a_new_site_file_has_the_rows_and_the_correction(studio: Studio, tmp_path: Path) -> None:
    found = opened(studio, "frame.ifc")
    setup = {**found["setup"], "kinds": [{"select": BEAMS, "kind": "steel", "means": None}]}
    studio.save({"path": found["path"], "setup": setup, "sha256": None})
    text = (tmp_path / "frame.site.toml").read_text()
    assert '  { select = "IfcBeam", kind = "steel" },\n  # { select = ' in text


REFUSED: tuple[tuple[dict[str, Any], str], ...] = (
    ({"kinds": [{"select": "IfcBeam", "kind": "wood"}]}, "type 1: kind: input should be 'precast'"),
    ({"kinds": [{"select": "IfcBeam"}]}, "type 1: it says nothing"),
    ({"kinds": [{"select": "IfcBaem", "kind": "timber"}]}, "has no class IfcBaem"),
    ({"kinds": [{"select": "IfcBeam + IfcColumn", "means": "built"}]}, "nothing to lift"),
    ({"part_kinds": {"x": "wood"}}, "'wood' is no kind of part"),
)


def test_what_cannot_be_is_refused_and_nothing_is_written(studio: Studio, tmp_path: Path) -> None:
    found = opened(studio)
    for changes, says in REFUSED:
        with pytest.raises(BimvoxError, match=says):
            studio.save({"path": "a.site.toml", "setup": {**found["setup"], **changes}, "sha256": found["sha256"]})
    assert (tmp_path / "a.site.toml").read_text() == HEAD


@pytest.mark.slow
def test_a_page_that_knows_no_kinds_changes_none(studio: Studio, tmp_path: Path) -> None:
    part = opened(studio)["parts"][0]["id"]
    save(studio, kinds=[{"select": BEAMS, "kind": "timber", "means": None}], part_kinds={part: "steel"})
    found = opened(studio)
    setup = {key: value for key, value in found["setup"].items() if key not in ("kinds", "part_kinds")}
    setup["cranes"] = [{**setup["cranes"][0], "base_m": [-7, -4]}]
    studio.save({"path": "a.site.toml", "setup": setup, "sha256": found["sha256"]})
    after = opened(studio)["setup"]
    assert (after["kinds"], after["part_kinds"]) == (found["setup"]["kinds"], {part: "steel"})
