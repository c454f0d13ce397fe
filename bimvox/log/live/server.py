"""The log's topics on a websocket, for viewers that look on (Foxglove and others that speak its protocol).

The same topics, schemas and bytes as in a log. What stays until it is sent again (cells, scene, path, events) is sent
to whoever begins to listen. Needs ``pip install 'bimvox[live]'``.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence
from typing import Any

from bimvox.errors import InputError
from bimvox.log import schema as topics


class LiveServer:
    """Serves the topics, once it is told of how many cranes (``advertise``).

    Args:
        host: Where to listen.
        port: Its port; 0 for any that is free.

    Raises:
        InputError: If the package is not installed, or the port cannot be had.
    """

    def __init__(self, host: str, port: int) -> None:
        try:
            import foxglove
        except ImportError:
            raise InputError(
                "a live server needs the package foxglove-sdk, which is not installed",
                hint="pip install 'bimvox[live]'",
            ) from None
        context = self._context = foxglove.Context()  # its channels close with it
        self._channels: dict[str, Any] = {}
        self._kept: dict[str, list[tuple[int, bytes]]] = {}
        self._lock = threading.Lock()
        try:
            self._server = foxglove.start_server(
                name="bimvox watch", host=host, port=port, context=context, server_listener=_Listener(self)
            )
        except (OSError, RuntimeError, ValueError) as error:
            raise InputError(f"cannot serve on {host}:{port}: {error}", hint="name another port") from error
        self.address = f"{host}:{self._server.port}"

    def advertise(self, cranes: int) -> None:
        """Say which topics there are: those of a log of a site with so many cranes."""
        import foxglove

        for topic in topics.topics_of(cranes):
            data = topic.descriptor_set_for(several_cranes=cranes > 1)
            self._channels[topic.name] = foxglove.Channel(
                topic.name,
                schema=foxglove.Schema(name=topic.schema, encoding="protobuf", data=data),
                message_encoding="protobuf",
                context=self._context,
            )

    def send(self, topic: str, time_ns: int, data: bytes) -> None:
        """Send a message to all who listen."""
        self._channels[topic].log(data, log_time=time_ns)

    def keep(self, messages: Sequence[tuple[str, int, bytes]]) -> None:
        """Send messages, and send them again to whoever begins to listen, until there are others of their topic."""
        kept: dict[str, list[tuple[int, bytes]]] = {}
        for topic, time_ns, data in messages:
            kept.setdefault(topic, []).append((time_ns, data))
        with self._lock:
            self._kept |= kept
        for topic in kept:
            self.send_again(topic)

    def send_again(self, topic: str, client: int | None = None) -> None:
        """Send what is kept of a topic; to one client alone where it is given."""
        with self._lock:
            kept = list(self._kept.get(topic, ()))
        for time_ns, data in kept:
            self._channels[topic].log(data, log_time=time_ns, sink_id=client)

    def close(self) -> None:
        """Stop serving."""
        self._server.stop()


class _Listener:
    """Whoever begins to listen gets what is kept."""

    def __init__(self, server: LiveServer) -> None:
        self._server = server

    def on_subscribe(self, client: Any, channel: Any) -> None:
        self._server.send_again(channel.topic, client.id)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("on_"):
            return lambda *_: None
        raise AttributeError(name)
