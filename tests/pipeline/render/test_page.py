from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from bimvox_pipeline.render.render import render
from bimvox_pipeline.verify import verify
from drawn_plans import motions_by_hand, plan_by_hand
from opened_pages import Opened

from bimvox.errors import InputError
from bimvox.log.plan_log import PlanLog
from bimvox.log.recorder import write_log
from bimvox.progress import SilentProgress


def write(path: Path, revision: int, *, infeasible: tuple[str, ...] = (), fixed_digest: str = "") -> Path:
    plan = plan_by_hand(crane=True, infeasible=infeasible)
    plan = dataclasses.replace(plan, site=dataclasses.replace(plan.site, fixed_digest=fixed_digest))
    with path.open("wb") as stream:
        write_log(stream, PlanLog(plan=plan, motions=motions_by_hand(plan), revision=revision))
    return path


def page(log: Path, *, proven: bool = False, progress: SilentProgress | None = None) -> Opened:
    out = log.with_suffix(".html")
    document = render(log, out, proven=proven, progress=progress or SilentProgress())
    assert document["out"] == str(out)
    assert document["bytes"] == out.stat().st_size
    return Opened(out.read_bytes())


def test_a_log_becomes_a_page_with_its_proof(tmp_path):
    log = write(tmp_path / "boxes.mcap", 0)
    (revision,) = page(log, proven=True).document["revisions"]
    proof = verify(log, progress=SilentProgress())
    assert revision["proof"]["verified"] == proof["verified"]
    assert {check["name"]: check["samples"] for check in revision["proof"]["checks"]} == {
        name: check["samples"] for name, check in proof["checks"].items()
    }
    assert revision["log"] == "boxes.mcap"
    assert len(revision["sha256"]) == 64


def test_without_a_proof_the_page_says_so(tmp_path):
    (revision,) = page(write(tmp_path / "boxes.mcap", 0)).document["revisions"]
    assert revision["proof"] is None


def test_the_same_log_gives_the_same_bytes(tmp_path):
    log = write(tmp_path / "boxes.mcap", 0)
    page(log)
    first = log.with_suffix(".html").read_bytes()
    page(log)
    assert log.with_suffix(".html").read_bytes() == first


def test_revisions_that_a_watch_left_are_in_the_page(tmp_path):
    write(tmp_path / "boxes.r0000.mcap", 0)
    write(tmp_path / "boxes.r0001.mcap", 1, infeasible=("roof",))
    write(tmp_path / "boxes.r0002.mcap", 2)
    write(tmp_path / "other.r0000.mcap", 0)
    log = write(tmp_path / "boxes.mcap", 2)
    revisions = page(log).document["revisions"]
    assert [revision["number"] for revision in revisions] == [0, 1, 2]
    assert [revision["log"] for revision in revisions] == ["boxes.r0000.mcap", "boxes.r0001.mcap", "boxes.mcap"]
    assert revisions[1]["changes"]["infeasible"] == [2]
    assert revisions[2]["changes"]["replanned"] == [2]
    # The file of a revision shows what caused it.
    assert [r["number"] for r in page(tmp_path / "boxes.r0001.mcap").document["revisions"]] == [0, 1]


def test_a_revision_that_is_damaged_or_of_another_site_is_left_out(tmp_path):
    write(tmp_path / "boxes.r0000.mcap", 0, fixed_digest="another")
    damaged = write(tmp_path / "boxes.r0001.mcap", 1)
    damaged.write_bytes(damaged.read_bytes()[:2000])
    progress = SilentProgress()
    opened = page(write(tmp_path / "boxes.mcap", 2), progress=progress)
    assert [revision["number"] for revision in opened.document["revisions"]] == [2]
    assert any("boxes.r0001.mcap is left out" in note for note in progress.notes)


def test_of_many_revisions_the_newest_are_in_the_page(tmp_path):
    for number in range(12):
        write(tmp_path / f"boxes.r{number:04d}.mcap", number)
    opened = page(write(tmp_path / "boxes.mcap", 11))
    assert [revision["number"] for revision in opened.document["revisions"]] == list(range(2, 12))
    assert opened.document["left_out"] == 2


def test_only_a_log_has_a_page(tmp_path):
    mesh = tmp_path / "box.obj"
    points = [" ".join(map(str, p)) for p in np.eye(3).tolist()]
    mesh.write_text("\n".join(f"v {p}" for p in points) + "\nf 1 2 3\n")
    with pytest.raises(InputError, match="only a log has a page"):
        render(mesh, tmp_path / "box.html", progress=SilentProgress())
    assert not (tmp_path / "box.html").exists()
