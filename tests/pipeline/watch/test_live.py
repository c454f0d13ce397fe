"""Live logs, and what viewers of a live server see."""

from __future__ import annotations

import errno
import json
import re
from pathlib import Path
from typing import Any

import pytest
from bimvox_pipeline.watch.live import DrivenLog, LiveView, address_of, driven_until_ns, live_logs, server_at
from foxglove_schemas_protobuf.Log_pb2 import Log
from planned_frame import planned
from websockets.sync import client

from bimvox.errors import InputError, LogFileError
from bimvox.log import schema as topics
from bimvox.log.live.log import LiveLog
from bimvox.log.live.server import TOKEN_VARIABLE, LiveServer
from bimvox.log.reader import read_log
from bimvox.progress import SilentProgress


@pytest.mark.parametrize(
    ("text", "address"), [("8765", ("127.0.0.1", 8765)), ("0.0.0.0:1", ("0.0.0.0", 1)), ("::1:80", ("::1", 80))]
)
def test_an_address_is_a_port_or_a_host_and_a_port(text, address):
    assert address_of(text) == address


@pytest.mark.parametrize("text", ["", "x", "host:", "99999", "1.5"])
def test_an_invalid_address_is_reported(text):
    with pytest.raises(InputError, match="not a port"):
        address_of(text)


def test_the_address_with_its_token_is_noted(monkeypatch):
    monkeypatch.delenv(TOKEN_VARIABLE, raising=False)
    quiet = SilentProgress()
    server_at("0", quiet).close()
    (note,) = quiet.notes
    assert re.fullmatch(r"viewers can connect to ws://127\.0\.0\.1:\d+/[\w-]{24}", note)


def test_a_server_that_others_can_reach_says_so_and_accepts_a_given_token(monkeypatch):
    monkeypatch.setenv(TOKEN_VARIABLE, "my-own-token-of-letters")
    quiet = SilentProgress()
    server_at("0.0.0.0:0", quiet).close()
    assert quiet.notes[0].endswith("/my-own-token-of-letters")
    assert "open to the network" in quiet.notes[1]


def driven(target: Path, time_ns: int | None) -> SilentProgress:
    """Run a watch that carries out the plan until a time; with None, it is killed before it writes anything."""
    quiet = SilentProgress()
    log = DrivenLog(target, quiet, 1, "plan")
    if time_ns is not None:
        log.send(topics.LOG, time_ns, Log(message="driven").SerializeToString())
    log.close()
    return quiet


def test_the_newest_live_logs_that_hold_something_are_kept(tmp_path):
    target = tmp_path / "frame.mcap"
    other = tmp_path / "other.live0000.mcap"
    other.write_bytes(b"")
    times_ns: list[int | None] = [1, None, 2, 3, None, 4, None, None, None, 5]
    for number, time_ns in enumerate(times_ns):
        assert not driven(target, time_ns).notes
        assert list(live_logs(target)) == list(range(number + 1))
    (note,) = driven(target, 6).notes
    assert "newest 5" in note
    assert list(live_logs(target)) == list(range(2, 11)), "runs that left nothing do not push out those that did"
    assert driven_until_ns(target, "plan") == 6
    assert driven_until_ns(target, "another") == 0
    assert other.exists()


def test_a_live_log_says_so_if_a_plan_is_requested(tmp_path):
    driven(tmp_path / "frame.mcap", 5)
    with pytest.raises(LogFileError, match="is a live log"):
        read_log(tmp_path / "frame.live0000.mcap")


def test_a_full_disk_removes_no_live_log(tmp_path, monkeypatch):
    target = tmp_path / "frame.mcap"
    for time_ns in range(1, 6):
        driven(target, time_ns)

    def full(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, "no space left on device")

    monkeypatch.setattr("bimvox.log.live.log.LiveLog.__init__", full)
    quiet = driven(target, 6)
    (note,) = quiet.notes
    assert note.startswith("the live log stops: no space left on device")
    assert list(live_logs(target)) == list(range(5))


def test_after_a_full_disk_a_live_log_continues_with_the_next_change(tmp_path, monkeypatch):
    """Otherwise the clock would go back to the last revision when the watch restarts."""
    target = tmp_path / "frame.mcap"
    log = DrivenLog(target, SilentProgress(), 1, "plan")
    log.send(topics.LOG, 5, Log(message="before").SerializeToString())
    save = LiveLog._save

    def full(_: LiveLog) -> None:
        raise OSError(errno.ENOSPC, "no space left on device")

    monkeypatch.setattr(LiveLog, "_save", full)
    assert log._log is not None
    log._log._failure = OSError(errno.ENOSPC, "no space left on device")
    for time_ns in (6, 7):
        log.keep([(topics.LOG, time_ns, Log(message="lost").SerializeToString())])
    assert list(live_logs(target)) == [0], "an attempt leaves nothing behind"
    monkeypatch.setattr(LiveLog, "_save", save)
    log.send(topics.LOG, 8, Log(message="lost").SerializeToString())
    log.keep([(topics.LOG, 9, Log(message="after").SerializeToString())])
    log.close()
    assert list(live_logs(target)) == [0, 1]
    assert driven_until_ns(target, "plan") == 9


def test_a_viewer_gets_what_stands_and_what_moves():

    record = read_log(planned() / "frame.mcap")
    server = LiveServer("127.0.0.1", 0, "sixteen-letters-")
    server.advertise(1)
    view = LiveView([server], None)
    view.show(record)
    try:
        with client.connect(server.url, subprotocols=["foxglove.sdk.v1"], max_size=None) as viewer:
            advertised: dict[str, Any] = {}
            while len(advertised) < len(topics.TOPICS):
                said = viewer.recv(timeout=20)
                if isinstance(said, str) and json.loads(said)["op"] == "advertise":
                    advertised |= {channel["topic"]: channel for channel in json.loads(said)["channels"]}
            assert set(advertised) == {topic.name for topic in topics.TOPICS}
            assert {channel["encoding"] for channel in advertised.values()} == {"protobuf"}
            names = [topics.VOXELS, topics.SCENE, topics.PLANNED, topics.TF, topics.JOINTS]
            numbers = {n: advertised[topic]["id"] for n, topic in enumerate(names)}
            subscriptions = [{"id": n, "channelId": channel} for n, channel in numbers.items()]
            viewer.send(json.dumps({"op": "subscribe", "subscriptions": subscriptions}))
            got: set[str] = set()
            while not set(names) <= got:  # while nothing moves, the crane is shown where it is
                said = viewer.recv(timeout=20)
                if isinstance(said, bytes) and said[0] == 1:
                    got.add(names[int.from_bytes(said[1:5], "little")])
    finally:
        view.close()


def test_each_cranes_topics_reach_a_viewer():
    """A log of one crane has no topics of a second crane; the server has the topics of all cranes of the site."""
    from two_cranes import two_crane_plan

    from bimvox.log.plan_log import PlanLog

    plan, motions = two_crane_plan()
    server = LiveServer("127.0.0.1", 0, "sixteen-letters-")
    server.advertise(2)
    view = LiveView([server], None)
    view.show(PlanLog(plan=plan, motions=motions))
    second = {topics.of_crane(topic, 1) for topic in (topics.PLANNED, topics.JOINTS, topics.COMMAND)}
    try:
        with client.connect(server.url, subprotocols=["foxglove.sdk.v1"], max_size=None) as viewer:
            topic_of: dict[int, str] = {}
            got: set[str] = set()
            while not second <= got:
                said = viewer.recv(timeout=20)
                if isinstance(said, str) and json.loads(said)["op"] == "advertise":
                    new = {channel["id"]: channel["topic"] for channel in json.loads(said)["channels"]}
                    topic_of |= new
                    subscriptions = [{"id": number, "channelId": number} for number in new]
                    viewer.send(json.dumps({"op": "subscribe", "subscriptions": subscriptions}))
                elif isinstance(said, bytes) and said[0] == 1:
                    got.add(topic_of[int.from_bytes(said[1:5], "little")])
            assert set(topic_of.values()) == {topic.name for topic in topics.topics_of(2)} - {topics.MOTION_TOPIC.name}
    finally:
        view.close()
