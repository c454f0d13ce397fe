"""One connected viewer of the live server: what it has subscribed to, and what it is sent."""

from __future__ import annotations

import asyncio
import contextlib
import json
import struct
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection


class Message(NamedTuple):
    """A message of a topic.

    Attributes:
        topic: The topic's name.
        time_ns: Time on the site's clock.
        data: The serialized message; all viewers share these bytes.
    """

    topic: str
    time_ns: int
    data: bytes


class Outbox:
    """The messages that wait for one viewer.

    A slow viewer misses states that have been replaced; what waits is never more than one state of every topic.
    """

    def __init__(self) -> None:
        self._standing: dict[str, list[Message]] = {}
        self._moving: dict[str, list[Message]] = {}

    @property
    def queued_bytes(self) -> int:
        """Bytes that wait."""
        waiting = (*self._standing.values(), *self._moving.values())
        return sum(len(message.data) for messages in waiting for message in messages)

    def keep(self, topic: str, messages: Sequence[Message]) -> None:
        """Put the standing messages of a topic in the place of all that waits of it."""
        self._moving.pop(topic, None)
        self._standing.pop(topic, None)
        if messages:
            self._standing[topic] = list(messages)

    def add(self, message: Message, at_once: int) -> None:
        """Put a message about something that moves in the place of those of earlier moments.

        ``at_once``: how many messages of one topic belong to one moment, one for each crane.
        """
        waiting = self._moving.pop(message.topic, [])
        same_moment = [one for one in waiting if one.time_ns == message.time_ns]
        self._moving[message.topic] = [*same_moment, message][-at_once:]

    def forget(self, topic: str) -> None:
        """Drop what waits of a topic."""
        self.keep(topic, ())

    def take(self) -> Message | None:
        """Remove and return the next message, standing ones first; None if none waits."""
        for waiting in (self._standing, self._moving):
            for topic, messages in waiting.items():
                message = messages.pop(0)
                if not messages:
                    del waiting[topic]
                return message
        return None


PIECE_BYTES = 1 << 16
"""A message is sent in pieces of this size, each after the one before has left: more is never copied for a viewer."""

_MESSAGE = struct.Struct("<BIQ")  # of a message of a channel: kind, subscription, time
_MESSAGE_KIND = 1
_MOST_ID = (1 << 32) - 1


class Viewer:
    """Sends what a viewer has subscribed to, as fast as the viewer reads and no faster.

    Args:
        connection: The open websocket.
        topics: Topics by channel id; grows when topics are announced.
        kept: Returns the standing messages of a topic, which a new subscriber gets first.
    """

    def __init__(
        self, connection: ServerConnection, topics: Mapping[int, str], kept: Callable[[str], Sequence[Message]]
    ) -> None:
        self._connection, self._topics, self._kept = connection, topics, kept
        self._outbox = Outbox()
        self._subscriptions: dict[str, int] = {}
        self._texts: list[str] = []
        self._news = asyncio.Event()
        self._sending_since_s: float | None = None

    @property
    def queued_bytes(self) -> int:
        """Bytes that wait here and in the socket's buffer."""
        return self._outbox.queued_bytes + sum(map(len, self._texts)) + self.buffered_bytes

    @property
    def buffered_bytes(self) -> int:
        """Bytes in the socket's buffer, which are this viewer's own."""
        return self._connection.transport.get_write_buffer_size()

    def waiting_s(self, now_s: float) -> float:
        """Return for how long the viewer has not taken a piece that waits for it."""
        return 0.0 if self._sending_since_s is None else now_s - self._sending_since_s

    def text(self, text: str) -> None:
        """Send a text of the protocol."""
        self._texts.append(text)
        self._news.set()

    def keep(self, topic: str, messages: Sequence[Message]) -> None:
        """Send standing messages."""
        if topic in self._subscriptions:
            self._outbox.keep(topic, messages)
            self._news.set()

    def add(self, message: Message, at_once: int) -> None:
        """Send a message about something that moves; ``at_once`` of a topic belong to one moment."""
        if message.topic in self._subscriptions:
            self._outbox.add(message, at_once)
            self._news.set()

    def drop(self) -> None:
        """Close the connection at once, with what waits."""
        self._connection.transport.abort()

    async def serve(self) -> None:
        """Take requests and send messages until the connection ends."""
        from websockets.exceptions import ConnectionClosed

        sender = asyncio.create_task(self._send())
        try:
            async for said in self._connection:
                if not self._obey(said):
                    self.drop()
        except ConnectionClosed:
            pass
        finally:
            sender.cancel()
            with contextlib.suppress(asyncio.CancelledError, ConnectionClosed):
                await sender

    async def _send(self) -> None:
        clock = asyncio.get_running_loop().time
        while True:
            self._sending_since_s = clock()
            if self._texts:
                await self._connection.send(self._texts.pop(0))
            elif (message := self._outbox.take()) is None:
                self._news.clear()
                self._sending_since_s = None
                await self._news.wait()
            elif (number := self._subscriptions.get(message.topic)) is not None:
                head = _MESSAGE.pack(_MESSAGE_KIND, number, message.time_ns)
                if len(message.data) <= PIECE_BYTES:
                    await self._connection.send(head + message.data)
                else:
                    await self._connection.send(self._pieces(head, message.data, clock))

    def _pieces(self, head: bytes, data: bytes, clock: Callable[[], float]) -> Iterator[bytes]:
        yield head
        for at in range(0, len(data), PIECE_BYTES):
            self._sending_since_s = clock()
            yield data[at : at + PIECE_BYTES]

    def _obey(self, said: str | bytes) -> bool:
        """Carry out a request; return whether it was one. Requests of other kinds are ignored."""
        if isinstance(said, bytes):
            return True
        try:
            request = json.loads(said)
        except (ValueError, RecursionError):
            return False
        if not isinstance(request, dict):
            return False
        if request.get("op") == "subscribe":
            for one in _list(request.get("subscriptions")):
                if isinstance(one, dict):
                    self._subscribe(one.get("id"), one.get("channelId"))
        elif request.get("op") == "unsubscribe":
            self._unsubscribe(_list(request.get("subscriptionIds")))
        return True

    def _subscribe(self, number: Any, channel: Any) -> None:
        """Subscribe to a channel; a second subscription to it is ignored, so that a topic is sent once."""
        topic = self._topics.get(channel) if isinstance(channel, int) else None
        if topic is None or topic in self._subscriptions or not (isinstance(number, int) and 0 <= number <= _MOST_ID):
            return
        self._subscriptions[topic] = number
        self.keep(topic, self._kept(topic))

    def _unsubscribe(self, numbers: list[Any]) -> None:
        for topic in [topic for topic, number in self._subscriptions.items() if number in numbers]:
            del self._subscriptions[topic]
            self._outbox.forget(topic)


def _list(value: Any) -> list[Any]:
    return value if isinstance(value, list) else []
