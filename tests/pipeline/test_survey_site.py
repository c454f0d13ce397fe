"""A site file in map coordinates, from the model to the proof."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from bimvox_pipeline.inspect.inspect import inspect
from bimvox_pipeline.plan import plan
from bimvox_pipeline.site import init

from bimvox.library.arguments import PolicyWish
from bimvox.library.verify import verify
from bimvox.log.reader import read_log
from bimvox.progress import SilentProgress

MODEL = Path(__file__).parents[2] / "sample_models" / "frame_georeferenced.ifc"


@pytest.mark.slow
def test_a_site_in_map_coordinates_gives_the_same_plan_and_is_proven(tmp_path: Path, store: Path) -> None:
    told = SilentProgress()
    init(MODEL, tmp_path / "a.site.toml", voxel_size_m=0.5, full=True, progress=told)
    on_map = inspect(tmp_path / "a.site.toml", told)["map"]
    text = (tmp_path / "a.site.toml").read_text()
    (crane,) = on_map["cranes"].values()
    text = text.replace('coordinates = "site"', 'coordinates = "map"', 1)
    text = re.sub(r"(?m)^base_m = \[[^]]*\]", f"base_m = {crane}", text)
    text = re.sub(r"(?m)^construction = .*$", f"construction = {[at[:2] for at in on_map['construction']]}", text)
    text = re.sub(r"(?m)^yard = .*$", f"yard = {[[at[:2] for at in one] for one in on_map['yard']]}", text)
    text = re.sub(r"(?m)^access = .*$", f"access = {[[at[:2] for at in one] for one in on_map['access']]}", text)
    (tmp_path / "b.site.toml").write_text(text)
    for name in "ab":
        plan(tmp_path / f"{name}.site.toml", tmp_path / f"{name}.mcap", wish=PolicyWish(), progress=told)
    first, second = (read_log(tmp_path / f"{name}.mcap") for name in "ab")
    assert second.plan.site.geometry_digest == first.plan.site.geometry_digest
    for one, other in zip(first.plan.lifts, second.plan.lifts, strict=True):
        np.testing.assert_array_equal(one.path_vox, other.path_vox)
    found = verify(tmp_path / "b.mcap", site=tmp_path / "b.site.toml", model=MODEL)
    assert found.verified, [check.failures for check in found.checks]
