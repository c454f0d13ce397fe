"""The log of a luffing crane: written, proven from the file alone, read back, exported and drawn."""

import json
import struct
from dataclasses import replace
from math import radians
from pathlib import Path

import numpy as np
import pytest
from bimvox_pipeline.verify import verify
from box_sites import box_site
from named_cranes import default_luffing_crane
from planned_sites import PORTAL, planned
from seeded_faults import site_file_of, with_files

from bimvox.crane.kinematics import joints_of, with_luffing_jib
from bimvox.exporters.animation import to_animated_glb
from bimvox.exporters.ros2 import write_ros2_bag
from bimvox.library.plan_value import write_log_file
from bimvox.library.site import rasterise
from bimvox.log.plan_log import PlanLog
from bimvox.log.reader import read_log
from bimvox.progress import SilentProgress
from bimvox.rendering.page.crane import LUFFING, crane_record
from bimvox.rendering.page.geometry import Blob
from bimvox.rendering.pictures.cranes import crane_parts, parked_pose
from bimvox.site.build import ground_and_masts, labels_of, with_digests


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, PlanLog]:
    crane = replace(default_luffing_crane("luffing-40"), name="short jib", base_m=(12.0, 18.0, 0.0))
    jib = replace(crane.luffing, pivot_height_m=9.0, length_m=24.0, luff_rad=(radians(20), radians(75)), tail_low_m=7.0)
    site = box_site(PORTAL, crane=with_luffing_jib(crane, jib), shape=(60, 50, 34))
    site = replace(site, blockers=(*ground_and_masts(site, rasterise), *site.blockers[1:]))
    site = with_digests(replace(site, labels=labels_of(site)))
    plan, motions = planned(site)
    record = with_files(PlanLog(plan, motions), {"site.toml": site_file_of(site)})
    path = tmp_path_factory.mktemp("luffing") / "log.mcap"
    write_log_file(path, record)
    return path, record


def test_the_log_is_proven_from_the_file_alone(written: tuple[Path, PlanLog]) -> None:
    document = verify(written[0], progress=SilentProgress())
    assert document["verified"], {name: check for name, check in document["checks"].items() if not check["passed"]}
    assert document["checks"]["jib"]["samples"]


def test_the_motions_read_back_the_same(written: tuple[Path, PlanLog]) -> None:
    path, record = written
    for before, after in zip(record.motions, read_log(path).motions, strict=True):
        assert after.loaded.radius_m == pytest.approx(before.loaded.radius_m, abs=1e-9)
        assert after.loaded.height_m == pytest.approx(before.loaded.height_m, abs=1e-9)
        assert np.array_equal(after.loaded.time_ns, before.loaded.time_ns)


def test_the_exports_contain_the_joints(written: tuple[Path, PlanLog], tmp_path: Path) -> None:
    record = written[1]
    glb = to_animated_glb(record)
    length = struct.unpack_from("<I", glb, 12)[0]
    names = {node.get("name") for node in json.loads(glb[20 : 20 + length])["nodes"]}
    assert {"mast", "platform", "jib", "tip", "rope"} <= names
    assert write_ros2_bag(record, tmp_path / "bag") > 0


def test_the_drawing_hangs_the_hook_from_the_tip(written: tuple[Path, PlanLog]) -> None:
    site = written[1].plan.site
    crane = site.cranes[0]
    assert crane is not None and crane.luffing is not None
    for kind in ("luffing", "mobile"):
        pose = parked_pose(site, site.cranes[0])
        parts = crane_parts(replace(crane, kind=kind), pose)
        assert all(np.isfinite(stroke.segments_m).all() for stroke in parts.strokes)
        tip = parts.points_m[2]
        axes = np.array([[pose.slew_rad, pose.radius_m, pose.height_m]])
        assert tip[2] - pose.height_m == pytest.approx(joints_of(crane, axes)[0, 2])
    blob = Blob()
    page = crane_record(crane, blob)
    assert page["luffing"]["length_m"] == crane.luffing.length_m
    assert page["kind"] == "luffing"
    assert LUFFING == 4
