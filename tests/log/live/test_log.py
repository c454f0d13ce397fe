"""A live log loses less than a second if it is killed at any moment; closed, it is a log like any other."""

from __future__ import annotations

import errno
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from foxglove_schemas_protobuf.Log_pb2 import Log

from bimvox.log import schema as topics
from bimvox.log.live.log import Driven, LiveLog, driven_of
from bimvox.log.mcap.reader import read_contents, salvage_contents

RECORD = {topics.METADATA: {"schema_version": "1"}}

CHILD = """
import sys, time
from foxglove_schemas_protobuf.Log_pb2 import Log
from bimvox.log import schema as topics
from bimvox.log.live.log import Driven, LiveLog, driven_of
log = LiveLog(sys.argv[1], {topics.METADATA: {"schema_version": "1"}}, {"note.txt": b"kept"})
while True:
    now_ns = time.time_ns()
    log.message(topics.LOG, now_ns, Log(message="x" * 200))
    print(now_ns, flush=True)
    time.sleep(0.002)
"""


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no kill -9 here")
def test_a_killed_process_loses_less_than_a_second(tmp_path: Path) -> None:
    path = tmp_path / "live.mcap"
    child = subprocess.Popen([sys.executable, "-c", CHILD, str(path)], stdout=subprocess.PIPE, text=True)
    assert child.stdout is not None
    said: list[int] = []
    reader = threading.Thread(target=lambda: said.extend(int(line) for line in child.stdout if line.endswith("\n")))
    reader.start()
    while len(said) < 2 or said[-1] - said[0] < 1_700_000_000:
        time.sleep(0.05)
        assert child.poll() is None
    os.kill(child.pid, signal.SIGKILL)
    child.wait()
    reader.join()
    saved = salvage_contents(path.read_bytes(), path)
    assert saved.attachments == {"note.txt": b"kept"}
    times = [message.time_ns for message in saved.messages]
    assert times == said[: len(times)]
    assert said[-1] - times[-1] < 1_000_000_000


def test_a_closed_live_log_is_sound_and_grows_meanwhile(tmp_path: Path) -> None:
    path = tmp_path / "live.mcap"
    with LiveLog(path, RECORD, {}, every_s=0.02) as log:
        begun = path.stat().st_size
        log.message(topics.LOG, 1, Log(message="first"))
        until = time.monotonic() + 10.0
        while path.stat().st_size == begun:
            assert time.monotonic() < until
            time.sleep(0.01)
        half = salvage_contents(path.read_bytes(), path)
        assert [message.time_ns for message in half.messages] == [1]
        log.message(topics.LOG, 2, Log(message="second"))
    whole = read_contents(path.read_bytes(), path)
    assert [message.time_ns for message in whole.messages] == [1, 2]
    assert whole.metadata == RECORD
    log.close()


def test_how_far_it_was_carried_out_is_known_without_reading_its_messages(tmp_path: Path) -> None:
    path = tmp_path / "live.mcap"
    log = LiveLog(path, RECORD, {"note.txt": b"kept"}, every_s=60.0)
    begun = path.stat().st_size
    assert driven_of(path) == Driven(RECORD[topics.METADATA], None)
    log.message(topics.LOG, 7, Log(message="first"))
    log._save()
    open_bytes = path.read_bytes()
    assert driven_of(path) == Driven(RECORD[topics.METADATA], 7)
    log.message(topics.LOG, 9, Log(message="second"))
    log.close()
    assert driven_of(path) == Driven(RECORD[topics.METADATA], 9)
    cut, zeros = tmp_path / "cut.mcap", tmp_path / "zeros.mcap"
    cut.write_bytes(open_bytes[: begun + 20])
    zeros.write_bytes(open_bytes + bytes(5000))
    assert driven_of(cut).last_ns is None
    assert driven_of(zeros).last_ns == 7
    with pytest.raises(OSError, match="No such file"):
        driven_of(tmp_path / "none.mcap")


def test_a_full_disk_is_reported_to_the_next_writer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    log = LiveLog(tmp_path / "live.mcap", RECORD, {}, every_s=0.01)

    def full() -> None:
        raise OSError(errno.ENOSPC, "no space left")

    monkeypatch.setattr(log, "_save", full)
    until = time.monotonic() + 10.0
    with pytest.raises(OSError, match="no space left"):
        while time.monotonic() < until:
            log.message(topics.LOG, 1, Log(message="x"))
            time.sleep(0.01)
    with pytest.raises(OSError, match="no space left"):
        log.close()
