"""Page and report of a log give the verdict of `bimvox verify`, and the remarks next to it."""

from __future__ import annotations

from pathlib import Path

import pytest
import seeded_faults as faults
from bimvox_pipeline.export import export
from bimvox_pipeline.render.render import render
from bimvox_pipeline.render.revisions import page_of_log
from bimvox_pipeline.report import report
from bimvox_pipeline.verify import verify
from opened_pages import Opened
from planned_sites import planned, portal_crane, portal_site

from bimvox.errors import LogFileError
from bimvox.library.plan_value import write_log_file
from bimvox.log.plan_log import PlanLog
from bimvox.progress import SilentProgress


@pytest.fixture(scope="module")
def good() -> PlanLog:
    plan, motions = planned(portal_site(portal_crane()))
    return PlanLog(plan=plan, motions=motions, attachments={}, metadata={})


def shown(log: PlanLog, folder: Path) -> tuple[dict, dict, dict]:
    """Return what verify, the report and the page say about a log."""
    file = folder / "log.mcap"
    write_log_file(file, log)
    record = report(file, folder / "log.html", pictures=0, progress=SilentProgress())["record"]
    page = Opened(page_of_log(file, proven=True, progress=SilentProgress())).document["revisions"][-1]
    return verify(file, progress=SilentProgress()), record, page


def test_lifts_proven_against_earlier_obstructions_only_are_named_in_both(good, tmp_path):
    document, record, page = shown(faults.an_epoch_before_the_last_lift(good), tmp_path)
    assert document["verified"] is True
    assert len(document["not_current"]) == 3
    assert record["proof"]["not_current"] == page["proof"]["not_current"] == document["not_current"]
    assert record["verdict"] == page["verdict"]
    assert record["remarks"] == page["remarks"] == document["remarks"]
    assert record["conditions"] == page["conditions"] == document["conditions"]
    assert record["not_covered"] == page["not_covered"] == document["not_covered"] != []
    claims = document["claims"]
    assert record["proof"]["claims"] == page["proof"]["claims"] == claims
    assert "Provided that:" in (tmp_path / "log.html").read_text(encoding="utf-8")
    told = f"proven, with {len(claims)} claims of the log, 3 lifts against earlier obstructions only"
    assert page["verdict"]["proof"] == told
    assert [lift["current"] for lift in page["lifts"]] == [False, False, False, True]


def test_a_fault_is_named_where_the_verdict_is_shown(good, tmp_path):
    document, record, page = shown(faults.a_slower_crane(good), tmp_path)
    assert document["verified"] is False
    assert record["verdict"]["proof"] == page["verdict"]["proof"] == "✕ NOT PROVEN: axis limits"
    assert page["verdict"]["proof_light"] == "refused"
    assert "Provided that:" not in (tmp_path / "log.html").read_text(encoding="utf-8")
    assert record["remarks"] == page["remarks"]
    assert page["remarks"]


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(faults.NONSENSE))
@pytest.mark.parametrize("proven", [True, False])
def test_values_that_make_no_sense_are_not_drawn(good, tmp_path, name, proven):
    file = tmp_path / "log.mcap"
    write_log_file(file, faults.NONSENSE[name][0](good))
    for show in (
        lambda: report(file, tmp_path / "log.html", proven=proven, pictures=0, progress=SilentProgress()),
        lambda: page_of_log(file, proven=proven, progress=SilentProgress()),
    ):
        with pytest.raises(LogFileError, match="its values make no sense, so it cannot be shown: "):
            show()
    assert not (tmp_path / "log.html").exists()


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(faults.NONSENSE))
def test_values_that_make_no_sense_are_neither_painted_nor_exported(good, tmp_path, name):
    file = tmp_path / "log.mcap"
    write_log_file(file, faults.NONSENSE[name][0](good))
    for suffix in (".png", ".gif"):
        with pytest.raises(LogFileError, match="its values make no sense, so it cannot be shown: "):
            render(file, tmp_path / f"log{suffix}", progress=SilentProgress())
    for suffix in (".csv", ".glb", ".json", ".out.mcap"):
        with pytest.raises(LogFileError, match="its values make no sense, so it cannot be exported: "):
            export(file, out=tmp_path / f"log{suffix}", progress=SilentProgress())
    assert [one.name for one in tmp_path.iterdir()] == ["log.mcap"]
