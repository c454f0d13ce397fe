"""``bimvox init``: the site file, and the drawing next to it."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from datetime import date
from math import pi
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
import trimesh
from bimvox_pipeline.site import init
from own_machine import SHEET

from bimvox.bim.building import Role
from bimvox.bim.options import ReadOptions
from bimvox.bim.read import read_building
from bimvox.errors import ConfigError, FileError, SelectionError
from bimvox.progress import SilentProgress
from bimvox.site.config.file import load_site_config, parse_site_config
from bimvox.site.config.machine_file import MACHINE_FILES
from bimvox.site.demand import hook_above_m
from bimvox.site.guess import complete_config, facing
from bimvox.site.machine import crane_of

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


def test_ones_own_machine_is_proposed_from_its_file_with_a_heading(tmp_path: Path) -> None:
    (tmp_path / "mx.toml").write_text(SHEET)
    site = tmp_path / "frame.site.toml"
    document = init(MODEL, site, crane=str(tmp_path / "mx.toml"), progress=SilentProgress())
    config = load_site_config(site)
    assert (document["crane"], config.crane.machine, config.crane.outriggers) == ("MX 60", "mx.toml", "full")
    crane = crane_of(config)
    assert crane.carrier.counterweight_kg == 12_000.0
    # With a boom that has a chart over the rear, the parts are behind the carrier.
    long = MACHINE_FILES.read(SHEET.encode(), Path("mx.toml")).with_jib(30.0)[0]
    parts = [element for element in read_building(MODEL).elements if element.role is Role.COMPONENT]
    hooks_m = np.array([hook_above_m(part)[:2] for part in parts])
    for aside_m in ((14.0, 0.0), (0.0, 14.0), (-10.0, -10.0)):
        base_m = hooks_m.mean(axis=0) + aside_m
        turned = facing(replace(long, base_m=(*base_m.tolist(), 0.0)), parts)
        x, y = (hooks_m - base_m).T
        behind = np.remainder(np.arctan2(y, x) - turned.carrier.heading_rad, 2 * pi) - pi
        assert (np.abs(behind) < np.radians(30.0)).any()


def test_the_file_of_a_machine_must_be_next_to_the_site_file_and_have_its_own_name(tmp_path: Path) -> None:
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "mx.toml").write_text(SHEET)
    with pytest.raises(FileError, match="not next to the site file"):
        init(MODEL, tmp_path / "a.site.toml", crane=str(elsewhere / "mx.toml"), progress=SilentProgress())
    (tmp_path / "mx.toml").write_text(SHEET.replace('name = "MX 60"', 'name = "mobile-60t"'))
    with pytest.raises(ConfigError, match="is known already"):
        init(MODEL, tmp_path / "a.site.toml", crane=str(tmp_path / "mx.toml"), progress=SilentProgress())
    with pytest.raises(FileError, match="no such file"):
        init(MODEL, tmp_path / "a.site.toml", crane=str(tmp_path / "none.toml"), progress=SilentProgress())
    assert not list(tmp_path.glob("*.site.toml"))


def test_the_start_is_the_one_asked_for_or_the_monday_after_the_model_was_written(tmp_path: Path) -> None:
    site = tmp_path / "a.site.toml"
    document = init(MODEL, site, progress=SilentProgress())
    assert document["start"] == "2024-01-08"
    assert "(2024-01-01)" in document["start_why"]
    assert "start = 2024-01-08  # First day of work. Here: assumed" in site.read_text()
    document = init(MODEL, site, start=date(2026, 12, 7), force=True, progress=SilentProgress())
    assert document["start"] == "2026-12-07"
    assert "start = 2026-12-07" in site.read_text()


def test_a_model_without_a_date_has_no_start(tmp_path: Path) -> None:
    site = tmp_path / "yard.site.toml"
    document = init(MODEL.with_name("yard.glb"), site, progress=SilentProgress())
    assert document["start"] is None
    assert "# start = " in site.read_text()
    assert "start" not in tomllib.loads(site.read_text()).get("calendar", {})


def test_a_site_file_is_short_and_whole_if_asked_for(tmp_path: Path) -> None:
    site = tmp_path / "a.site.toml"
    init(MODEL, site, progress=SilentProgress())
    short = site.read_text()
    init(MODEL, site, full=True, force=True, progress=SilentProgress())
    whole = site.read_text()
    assert len(short.partition("# -----")[0].strip().splitlines()) <= 25
    assert "[rules.times]" in whole
    assert "[rules.times]" not in short
    assert parse_site_config(short, site).model_dump() == parse_site_config(whole, site).model_dump()
