"""A site with two cranes from the site file to the log, and revised when something comes into the way."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bimvox.errors import InputError
from bimvox.log.reader import read_log
from pipeline.plan import plan
from pipeline.progress import SilentProgress
from pipeline.verify import verify
from pipeline.watch import watch

SAMPLES = Path(__file__).parents[2] / "sample_models"


SITE = """
name = "frame"
[model]
path = "frame.ifc"
voxel_size_m = 0.25
[areas]
construction = [[-1, -1], [7.5, -1], [7.5, 7.5], [-1, 7.5]]
yard = [[[-0.5, -8.5], [6.5, -8.5], [6.5, -2], [-0.5, -2]], [[10, -6], [16, -6], [16, 6], [10, 6]]]
[[crane]]
name = "west"
machine = "hammerhead-30"
base_m = [-3, 0]
jib_height_m = 15.5
jib_length_m = 18
[[crane]]
name = "east"
machine = "hammerhead-30"
base_m = [20, 1]
jib_height_m = 26
"""


@pytest.fixture(scope="module")
def two(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    """The folder of the sample frame with two cranes of two heights, and the plan's document."""
    folder = tmp_path_factory.mktemp("frame")
    shutil.copy(SAMPLES / "frame.ifc", folder)
    (folder / "frame.site.toml").write_text(SITE)
    document = plan(folder / "frame.site.toml", folder / "frame.mcap", policy="none", progress=SilentProgress())
    return folder, document


def test_every_lift_is_planned_and_each_crane_has_its_share(two: tuple[Path, dict[str, Any]]) -> None:
    _, document = two
    assert not document["infeasible"]
    cranes = document["figures"]["cranes"]
    assert [crane["name"] for crane in cranes] == ["west", "east"]
    by_name = [lift["crane"] for lift in document["lifts"]]
    assert [by_name.count(crane["name"]) for crane in cranes] == [crane["lifts"] for crane in cranes]
    assert all(crane["lifts"] >= 3 and 0.3 < crane["busy_share"] <= 1.0 for crane in cranes)
    assert document["figures"]["crane_hours"] < sum(crane["busy_hours"] for crane in cranes)


def test_the_log_proves_itself_and_is_the_same_again(two: tuple[Path, dict[str, Any]], tmp_path: Path) -> None:
    folder, _ = two
    assert verify(folder / "frame.mcap", progress=SilentProgress())["verified"]
    plan(folder / "frame.site.toml", tmp_path / "again.mcap", policy="none", progress=SilentProgress())
    assert (tmp_path / "again.mcap").read_bytes() == (folder / "frame.mcap").read_bytes()


def test_a_change_keeps_paths_and_times_before_it(two: tuple[Path, dict[str, Any]], tmp_path: Path) -> None:
    folder, _ = two
    before = read_log(folder / "frame.mcap")
    last = before.plan.lifts[-1]
    assert last.path_vox is not None
    site = before.plan.site
    at_m = site.frame.corner_of(last.path_vox[len(last.path_vox) // 2])
    box = {"min": [float(n) for n in at_m], "max": [float(n) for n in at_m + 0.5]}
    for name in ("frame.ifc", "frame.site.toml", "frame.mcap"):
        shutil.copy(folder / name, tmp_path)
    file = tmp_path / "way.json"
    file.write_text(json.dumps({"version": 1, "unit": "m", "obstructions": [{"id": "box", "box": box}]}))
    site_file, log = tmp_path / "frame.site.toml", tmp_path / "frame.mcap"
    documents = list(watch(file, site=site_file, out=log, once=True, policy="none", progress=SilentProgress()))
    assert [document["event"] for document in documents] == ["replanned"]
    now = read_log(log)
    motions = {motion.order: motion for motion in now.motions}
    changed = {lift.order for lift in now.plan.lifts if lift.component == last.component}
    for one, other in zip(before.plan.lifts, now.plan.lifts, strict=True):
        if one.order not in changed and one.path_vox is not None and other.path_vox is not None:
            kept = np.array_equal(one.path_vox, other.path_vox)
            assert kept or site.components[one.component].global_id in documents[0]["replanned"]
    first = before.motions[0]
    assert motions[first.order].phases == first.phases
    assert verify(log, progress=SilentProgress())["verified"]


def test_carrying_it_out_against_a_clock_is_refused_in_a_sentence(
    two: tuple[Path, dict[str, Any]], tmp_path: Path
) -> None:
    folder, _ = two
    file = tmp_path / "way.json"
    file.write_text('{"version": 1, "unit": "m", "obstructions": []}')
    site, log = folder / "frame.site.toml", tmp_path / "out.mcap"
    with pytest.raises(InputError, match="2 cranes"):
        list(watch(file, site=site, out=log, once=True, policy="none", speed=60.0, progress=SilentProgress()))
