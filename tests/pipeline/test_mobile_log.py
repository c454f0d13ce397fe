"""The log of a mobile crane that carries over its rear only: forged headings and outriggers fail by name."""

from __future__ import annotations

import re
import shutil
from collections.abc import Mapping
from dataclasses import replace
from math import pi
from pathlib import Path
from typing import Any

import pytest
import seeded_faults as faults
from bimvox_pipeline.plan import plan
from bimvox_pipeline.site import init
from bimvox_pipeline.verify import verify
from own_machine import SHEET

from bimvox.crane.carrier import Carrier
from bimvox.library.arguments import PolicyWish
from bimvox.library.plan_value import write_log_file
from bimvox.log.plan_log import PlanLog
from bimvox.log.reader import read_log
from bimvox.progress import SilentProgress

FRAME = Path(__file__).parents[2] / "sample_models" / "frame.ifc"
_HEAD, _, _REAR, _HALF = SHEET.split("[[table]]")
MACHINE = "[[table]]".join((_HEAD.replace("deg = [150, 210]", "deg = [90, 270]"), _REAR, _HALF))
"""With full outriggers it carries over the rear only; with half of them in every direction."""


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> PlanLog:
    folder = tmp_path_factory.mktemp("mobile")
    shutil.copy(FRAME, folder)
    (folder / "mx.toml").write_text(MACHINE)
    site = folder / "frame.site.toml"
    init(folder / "frame.ifc", site, voxel_size_m=0.5, crane=str(folder / "mx.toml"), progress=SilentProgress())
    assert plan(site, folder / "log.mcap", wish=PolicyWish("none"), progress=SilentProgress())["verified"]
    return read_log(folder / "log.mcap")


def forged(log: PlanLog, carrier: Carrier, files: Mapping[str, bytes] | None = None) -> PlanLog:
    """Return a log with another set-up of its crane, and other attached files; the forger rewrites all digests."""
    (crane,) = log.plan.site.cranes
    site = replace(log.plan.site, cranes=(replace(crane, carrier=carrier),))
    return faults.with_files(faults.without_a_new_file(log, site), dict(log.attachments) | dict(files or {}))


def refused(log: PlanLog, folder: Path) -> dict[str, str]:
    """Return what `verify` says of each check that fails."""
    write_log_file(folder / "forged.mcap", log)
    document: dict[str, Any] = verify(folder / "forged.mcap", progress=SilentProgress())
    return {name: " ".join(one["failures"]) for name, one in document["checks"].items() if not one["passed"]}


def carrier_of(log: PlanLog) -> Carrier:
    (crane,) = log.plan.site.cranes
    assert crane.carrier is not None and crane.carrier.outriggers is not None
    return crane.carrier


def test_the_log_itself_is_proven(good: PlanLog, tmp_path: Path) -> None:
    carrier = carrier_of(good)
    assert [sector.name for sector in carrier.sectors if sector.chart is not None] == ["over rear"]
    assert refused(forged(good, carrier), tmp_path) == {}


def test_a_heading_that_is_not_the_site_files_is_found(good: PlanLog, tmp_path: Path) -> None:
    carrier = carrier_of(good)
    found = refused(forged(good, replace(carrier, heading_rad=carrier.heading_rad + 0.1)), tmp_path)
    assert "heading_rad" in found["own_files"]


def test_a_heading_turned_round_in_log_and_site_file_leaves_the_loads_without_a_chart(
    good: PlanLog, tmp_path: Path
) -> None:
    carrier, text = carrier_of(good), good.attachments["site.toml"].decode()
    (stated,) = re.findall(r"^heading_deg = (\S+)", text, re.M)
    turned = text.replace(f"heading_deg = {stated}", f"heading_deg = {float(stated) + 180.0}")
    log = forged(good, replace(carrier, heading_rad=carrier.heading_rad + pi), {"site.toml": turned.encode()})
    found = refused(log, tmp_path)
    assert {"reach", "capacity"} <= set(found)
    assert "own_files" not in found, "the site file says so too"


def test_outriggers_further_out_than_the_machine_files_are_found(good: PlanLog, tmp_path: Path) -> None:
    carrier = carrier_of(good)
    assert carrier.outriggers is not None
    wider = replace(carrier.outriggers, left_m=carrier.outriggers.left_m + 1.0)
    assert "outriggers" in refused(forged(good, replace(carrier, outriggers=wider)), tmp_path)["own_files"]


def test_half_the_outriggers_in_log_and_site_file_have_no_such_chart(good: PlanLog, tmp_path: Path) -> None:
    carrier, text = carrier_of(good), good.attachments["site.toml"].decode()
    assert carrier.outriggers is not None
    half = replace(carrier, outriggers=replace(carrier.outriggers, name="half", left_m=2.2, right_m=2.2))
    changed = text.replace('outriggers = "full"', 'outriggers = "half"').encode()
    assert changed != text.encode()
    assert "half" in refused(forged(good, half, {"site.toml": changed}), tmp_path)["own_files"]
