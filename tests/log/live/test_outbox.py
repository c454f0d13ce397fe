"""The messages that wait for a viewer."""

from __future__ import annotations

from bimvox.log.live.viewer import Message, Outbox


def everything(outbox: Outbox) -> list[Message]:
    return list(iter(outbox.take, None))


def test_standing_messages_come_first_and_in_order():
    outbox = Outbox()
    scene = [Message("/scene", 5, b"all"), Message("/scene", 5, b"change")]
    outbox.add(Message("/tf", 6, b"moves"), 1)
    outbox.keep("/scene", scene)
    assert outbox.queued_bytes == len(b"movesallchange")
    assert everything(outbox) == [*scene, Message("/tf", 6, b"moves")]
    assert outbox.queued_bytes == 0


def test_a_slow_viewer_gets_the_newest_state_only():
    outbox = Outbox()
    for time_ns in range(1000):
        outbox.add(Message("/tf", time_ns, bytes(100)), 1)
        outbox.keep("/scene", [Message("/scene", time_ns, bytes(1000))] * 2)
        assert outbox.queued_bytes <= 2100
    assert {message.time_ns for message in everything(outbox)} == {999}


def test_the_messages_of_all_cranes_at_one_moment_are_kept():
    outbox = Outbox()
    for time_ns in (1, 2, 2, 2):
        for crane in (b"first", b"second"):
            outbox.add(Message("/tf", time_ns, crane), 2)
    assert everything(outbox) == [Message("/tf", 2, b"first"), Message("/tf", 2, b"second")]


def test_new_standing_messages_replace_all_waiting_messages_of_their_topic():
    outbox = Outbox()
    outbox.keep("/scene", [Message("/scene", 1, b"old")] * 3)
    outbox.add(Message("/scene", 2, b"old"), 1)
    outbox.take()
    outbox.keep("/scene", [Message("/scene", 3, b"new")])
    assert everything(outbox) == [Message("/scene", 3, b"new")]
    outbox.keep("/scene", [Message("/scene", 4, b"new")])
    outbox.forget("/scene")
    assert outbox.take() is None
