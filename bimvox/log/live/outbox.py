"""What a viewer has not received yet: of each topic only the newest state."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple


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

        Args:
            message: The message.
            at_once: How many messages of one topic belong to one moment: one for each crane.
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
