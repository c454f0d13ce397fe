"""The live server with real connections on this machine."""

from __future__ import annotations

import json
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, suppress
from itertools import count
from typing import Any

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync import client
from websockets.sync.client import ClientConnection

from bimvox.errors import InputError
from bimvox.log import schema as topics
from bimvox.log.live import server as server_module
from bimvox.log.live.server import BUFFER_BYTES, MAX_PENDING, LiveServer
from bimvox.log.live.viewer import PIECE_BYTES

TOKEN = "Abc-0123_456789xyz"
LARGE = bytes(8 << 20)
"""More than the socket buffers of the system hold."""


@pytest.fixture
def server() -> Iterator[LiveServer]:
    served = LiveServer("127.0.0.1", 0, TOKEN)
    served.advertise(1)
    yield served
    served.close()


def connected(url: str, **options: Any) -> ClientConnection:
    return client.connect(url, subprotocols=["foxglove.sdk.v1"], max_size=None, compression=None, **options)  # type: ignore[list-item]


def channels(viewer: ClientConnection) -> dict[str, int]:
    """Return the ids of the announced channels by topic."""
    for _ in range(2):
        said = json.loads(viewer.recv(timeout=20))
        if said["op"] == "advertise":
            return {channel["topic"]: channel["id"] for channel in said["channels"]}
    raise AssertionError("no channels were announced")


def subscribe(viewer: ClientConnection, *names: str) -> None:
    ids = channels(viewer)
    wanted = [{"id": number, "channelId": ids[name]} for number, name in enumerate(names)]
    viewer.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))


def waited_for(what: Callable[[], bool]) -> bool:
    """Return whether a condition becomes true within a minute."""
    deadline_s = time.monotonic() + 60
    while not what():
        if time.monotonic() > deadline_s:
            return False
        time.sleep(0.01)
    return True


def test_a_client_without_the_token_is_refused(server):
    for url in (server.url.removesuffix(TOKEN), f"{server.url}x"):
        with pytest.raises(InvalidStatus) as refused:
            connected(url)
        assert refused.value.response.status_code == 401
    assert server.viewers == 0


def test_a_page_of_another_site_is_refused_and_foxglove_is_not(server):
    with pytest.raises(InvalidStatus) as refused:
        connected(server.url, origin="https://evil.example")
    assert refused.value.response.status_code == 403
    with connected(server.url, origin="https://app.foxglove.dev") as viewer:
        assert channels(viewer).keys() == {topic.name for topic in topics.TOPICS}


def test_too_many_viewers_are_refused(server, monkeypatch):
    monkeypatch.setattr(server_module, "MAX_VIEWERS", 1)
    with connected(server.url) as first:
        channels(first)
        with pytest.raises(InvalidStatus) as refused:
            connected(server.url)
    assert refused.value.response.status_code == 503


def test_a_large_message_arrives_whole(server):
    data = bytes(range(256)) * (5 * PIECE_BYTES // 256) + b"end"
    server.keep([(topics.SCENE, 5, data)])
    with connected(server.url) as viewer:
        subscribe(viewer, topics.SCENE)
        said = viewer.recv(timeout=20)
    assert said == b"\1" + bytes(4) + (5).to_bytes(8, "little") + data


def test_a_topic_is_sent_once_and_not_after_its_subscription_has_ended(server):
    with connected(server.url) as viewer:
        ids = channels(viewer)
        twice = [{"id": number, "channelId": ids[topics.TF]} for number in (1, 2)]
        for request in (
            {"op": "subscribe", "subscriptions": [*twice, {"id": 3, "channelId": 9999}, {"id": -1}, "x", None]},
            {"op": "unknown"},
            {"op": "subscribe", "subscriptions": [{"id": 4, "channelId": ids[topics.LOG]}]},
        ):
            viewer.send(json.dumps(request))
        server.keep([(topics.LOG, 1, b"ready"), (topics.TF, 2, b"place")])
        said = [viewer.recv(timeout=20)]
        while said[-1][-5:] != b"place":  # type: ignore[comparison-overlap]
            server.keep([(topics.LOG, 1, b"ready"), (topics.TF, 2, b"place")])
            said.append(viewer.recv(timeout=20))
        assert {bytes(one[1:5]) for one in said} <= {(4).to_bytes(4, "little"), (1).to_bytes(4, "little")}  # type: ignore[arg-type]
        viewer.send(json.dumps({"op": "unsubscribe", "subscriptionIds": [1]}))
        viewer.send(json.dumps({"op": "subscribe", "subscriptions": [{"id": 5, "channelId": ids[topics.SCENE]}]}))
        server.keep([(topics.SCENE, 3, b"after")])
        while viewer.recv(timeout=20)[-5:] != b"after":  # type: ignore[comparison-overlap]
            pass
        server.send(topics.TF, 4, b"moves")
        server.send(topics.SCENE, 5, b"moves")
        assert viewer.recv(timeout=20)[1:5] == (5).to_bytes(4, "little")


@pytest.mark.parametrize("said", ["nonsense", "[" * 60_000, "9" * 10_000, '"text"', "x" * 100_000])
def test_a_viewer_that_does_not_speak_the_protocol_is_dropped(server, said):
    with connected(server.url) as viewer:
        channels(viewer)
        viewer.send(said)
        with pytest.raises(ConnectionClosed):
            viewer.recv(timeout=20)
    assert waited_for(lambda: server.viewers == 0)


@pytest.mark.slow
def test_what_waits_for_viewers_that_never_read_is_bounded(server):
    """For each viewer one state per topic waits, in bytes that all viewers share, with little memory of its own."""
    with ExitStack() as stack:
        for _ in range(10):
            viewer = stack.enter_context(connected(server.url, max_queue=1))
            subscribe(viewer, topics.SCENE, topics.TF)
        for time_ns in range(30):
            server.keep([(topics.SCENE, time_ns, LARGE)])
            server.send(topics.TF, time_ns, LARGE)
            assert server.queued_bytes() <= 2 * len(LARGE) + BUFFER_BYTES
        assert waited_for(lambda: server.queued_bytes() > len(LARGE)), "nothing waits: the test tests nothing"
        own = [viewer.buffered_bytes for viewer in server._viewers]
        assert len(own) == 10
        assert max(own) <= BUFFER_BYTES


@pytest.mark.slow
def test_a_viewer_that_reads_nothing_is_dropped_without_a_message(server, monkeypatch, capfd):
    monkeypatch.setattr(server_module, "_STALLED_S", 0.2)
    with connected(server.url, max_queue=1) as slow, connected(server.url) as quick:
        subscribe(slow, topics.SCENE)
        subscribe(quick, topics.LOG)
        assert waited_for(lambda: server.viewers == 2)
        clock = count()
        server.keep([(topics.SCENE, next(clock), LARGE)])
        assert waited_for(lambda: server.viewers == 1)
        server.keep([(topics.LOG, next(clock), b"still here")])
        assert bytes(quick.recv(timeout=20)[-10:]) == b"still here"  # type: ignore[arg-type]
    assert waited_for(lambda: server.viewers == 0)
    assert capfd.readouterr().err == ""


def test_viewers_that_leave_print_nothing(server, capfd):
    for _ in range(5):
        with suppress(OSError, ConnectionClosed), connected(server.url, max_queue=1) as viewer:
            subscribe(viewer, topics.SCENE)
            server.keep([(topics.SCENE, 1, LARGE)])
            viewer.socket.close()
        for time_ns in range(20):
            server.keep([(topics.SCENE, time_ns, LARGE)])
    assert waited_for(lambda: server.viewers == 0)
    assert capfd.readouterr().err == ""


def test_connections_that_never_show_the_token_are_bounded_and_keep_nobody_out(server, capfd):
    many = 5 * MAX_PENDING
    host, port = server.url.split("/")[2].split(":")
    with ExitStack() as stack:
        silent = [stack.enter_context(socket.create_connection((host, int(port)))) for _ in range(many)]
        with connected(server.url) as viewer:
            assert channels(viewer)
            for one in silent:
                one.setblocking(False)

            def closed(one: socket.socket) -> bool:
                try:
                    return one.recv(1) == b""
                except BlockingIOError:
                    return False
                except ConnectionResetError:
                    return True

            assert sum(map(closed, silent)) >= many - MAX_PENDING
    assert capfd.readouterr().err == ""


def test_a_port_in_use_is_reported(server):
    port = server.url.split(":")[2].split("/")[0]
    with pytest.raises(InputError, match=f"cannot serve on 127.0.0.1:{port}"):
        LiveServer("127.0.0.1", int(port), TOKEN)
