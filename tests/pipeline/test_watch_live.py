"""The live server: needs foxglove-sdk (the extra ``live``) and a websocket client; skipped without them."""

from __future__ import annotations

import json
from typing import Any

import pytest

from bimvox.errors import InputError
from bimvox.log import topics
from pipeline.watch_live import LiveView, address_of


@pytest.mark.parametrize(
    ("text", "address"), [("8765", ("127.0.0.1", 8765)), ("0.0.0.0:1", ("0.0.0.0", 1)), ("::1:80", ("::1", 80))]
)
def test_an_address_is_a_port_or_a_host_and_a_port(text, address):
    assert address_of(text) == address


@pytest.mark.parametrize("text", ["", "x", "host:", "99999", "1.5"])
def test_what_is_no_address_is_said(text):
    with pytest.raises(InputError, match="not a port"):
        address_of(text)


def test_a_viewer_gets_what_stands_and_what_moves(planned):
    pytest.importorskip("foxglove")
    client = pytest.importorskip("websockets.sync.client")
    from bimvox.log.live_server import LiveServer
    from bimvox.log.reader import read_log

    record = read_log(planned[0] / "frame.mcap")
    server = LiveServer("127.0.0.1", 0)
    server.advertise(1)
    view = LiveView([server], None)
    view.show(record)
    try:
        with client.connect(f"ws://{server.address}", subprotocols=["foxglove.sdk.v1"], max_size=None) as viewer:
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
            while not set(names) <= got:  # where nothing moves, the crane is shown as it stands
                said = viewer.recv(timeout=20)
                if isinstance(said, bytes) and said[0] == 1:
                    got.add(names[int.from_bytes(said[1:5], "little")])
    finally:
        view.close()


def test_each_cranes_topics_reach_a_viewer():
    """A log of one crane knows no topics of a second one; the server has as many as the site has cranes."""
    pytest.importorskip("foxglove")
    client = pytest.importorskip("websockets.sync.client")
    from two_cranes import two_crane_plan

    from bimvox.log.live_server import LiveServer
    from bimvox.log.plan_log import PlanLog

    plan, motions = two_crane_plan()
    server = LiveServer("127.0.0.1", 0)
    server.advertise(2)
    view = LiveView([server], None)
    view.show(PlanLog(plan=plan, motions=motions))
    second = {topics.of_crane(topic, 1) for topic in (topics.PLANNED, topics.JOINTS, topics.COMMAND)}
    try:
        with client.connect(f"ws://{server.address}", subprotocols=["foxglove.sdk.v1"], max_size=None) as viewer:
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
            assert set(topic_of.values()) == {topic.name for topic in topics.topics_of(2)}
    finally:
        view.close()
