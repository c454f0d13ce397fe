"""Logs that are written while their plans are being proven."""

from pathlib import Path

import pytest
from bimvox_pipeline.plan import LogAhead, plan

from bimvox.errors import FileError, VerificationError
from bimvox.library import prove
from bimvox.library.arguments import PolicyWish
from bimvox.log.reader import read_log
from bimvox.log.recorder import write_log
from bimvox.progress import SilentProgress
from bimvox.proof.motion import verify_motions
from bimvox.records.proof import Check, Verification
from bimvox.workers import ALONE, Workers


def plan_shared(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Plan the frame again with two processes, over the log that is there."""
    monkeypatch.setattr("bimvox.library.arguments._FEW_PARTS", 1)
    log = folder / "frame.mcap"
    plan(folder / "frame.site.toml", log, wish=PolicyWish("none"), jobs=2, progress=SilentProgress())
    return log


def left_in(folder: Path) -> list[Path]:
    return [*folder.glob(".bimvox-*")]


def test_a_log_is_whole_on_disk_before_its_plan_is_proven(site_folder, monkeypatch):
    plan(site_folder / "frame.site.toml", alone := site_folder / "alone.mcap", wish=PolicyWish("none"), jobs=1,
         progress=SilentProgress())  # fmt: skip
    ahead, written = [], []

    def submitted(self, *given):
        log_begins(self, *given)
        ahead.append(self._begun[2])

    def late(*given, **known):
        written.append(ahead[-1].result(60).read_bytes())
        return verify_motions(*given, **known)

    log_begins = LogAhead.begin
    monkeypatch.setattr(LogAhead, "begin", submitted)
    monkeypatch.setattr(prove, "verify_motions", late)
    log = plan_shared(site_folder, monkeypatch)
    assert written == [log.read_bytes()] == [alone.read_bytes()]
    assert left_in(site_folder) == []


def test_a_plan_that_is_not_proven_leaves_no_log_and_the_next_one_is_the_log(site_folder, monkeypatch):
    rounds = []

    def once_refused(made, motions, **known):
        rounds.append(motions)
        if len(rounds) == 1:
            check = Check("motion_triangles")
            check.about = made.site.components[motions[0].component].id
            check.look(False, f"{check.about}: refused")
            return Verification((check,))
        return verify_motions(made, motions, **known)

    monkeypatch.setattr(prove, "verify_motions", once_refused)
    log = plan_shared(site_folder, monkeypatch)
    assert len(rounds) == 2
    assert [len(motion.loaded.time_ns) for motion in read_log(log).motions] == [
        len(motion.loaded.time_ns) for motion in rounds[1]
    ]
    assert left_in(site_folder) == []


def test_a_plan_without_proof_changes_no_log(site_folder, monkeypatch):
    def refused(*_, **__):
        check = Check("timeline")
        check.look(False, "refused")
        return Verification((check,))

    earlier = (site_folder / "frame.mcap").read_bytes()
    monkeypatch.setattr(prove, "verify_motions", refused)
    with pytest.raises(VerificationError, match="refused"):
        plan_shared(site_folder, monkeypatch)
    assert (site_folder / "frame.mcap").read_bytes() == earlier
    assert left_in(site_folder) == []


def test_a_full_disk_while_the_proof_goes_on_is_said_and_changes_no_log(site_folder, monkeypatch):
    def full(stream, record, *, workers):
        write_log(stream, record, workers=workers)
        raise OSError(28, "No space left on device")

    earlier = (site_folder / "frame.mcap").read_bytes()
    monkeypatch.setattr("bimvox_pipeline.plan.write_log", full)
    with pytest.raises(FileError, match="cannot be written"):
        plan_shared(site_folder, monkeypatch)
    assert (site_folder / "frame.mcap").read_bytes() == earlier
    assert left_in(site_folder) == []


def test_what_was_begun_in_vain_ends_at_once(site_folder, monkeypatch):
    record, blocks = read_log(site_folder / "frame.mcap"), []

    def endless(stream, record, *, workers):
        while True:
            blocks.append(stream.write(b"block"))

    monkeypatch.setattr("bimvox_pipeline.plan.write_log", endless)
    workers = Workers(2)
    try:
        with pytest.raises(KeyboardInterrupt), LogAhead(site_folder / "again.mcap") as log:
            log.begin(record, workers)
            raise KeyboardInterrupt
    finally:
        workers.close()
    assert set(blocks) <= {5}
    assert left_in(site_folder) == []
    assert not (site_folder / "again.mcap").exists()


def test_one_process_writes_when_the_proof_is_done(site_folder):
    record = read_log(site_folder / "frame.mcap")
    with LogAhead(site_folder / "again.mcap") as log:
        log.begin(record, ALONE)
        assert left_in(site_folder) == []
        log.finish(record, ALONE)
    assert (site_folder / "again.mcap").read_bytes() == (site_folder / "frame.mcap").read_bytes()
