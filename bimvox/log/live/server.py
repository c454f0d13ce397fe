"""The log's topics on a websocket, for live viewers (Foxglove and others that use its protocol).

The same topics, schemas and bytes as in a log. A new listener first gets the standing messages (cells, scene, paths,
events). Needs ``pip install 'bimvox[live]'``.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence
from typing import Any

from bimvox.errors import InputError
from bimvox.log import schema as topics


class LiveServer:
    """Serves the topics, after ``advertise`` has set the number of cranes.

    Args:
        host: The address to listen on.
        port: The port; 0 for any free port.

    Raises:
        InputError: If the package is not installed, or the port cannot be opened.
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
            raise InputError(f"cannot serve on {host}:{port}: {error}", hint="choose another port") from error
        self.address = f"{host}:{self._server.port}"

    def advertise(self, cranes: int) -> None:
        """Announce the topics of a log of a site with this many cranes."""
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
        """Send a message to all listeners."""
        self._channels[topic].log(data, log_time=time_ns)

    def keep(self, messages: Sequence[tuple[str, int, bytes]]) -> None:
        """Send messages, and send them again to every new listener, until others of their topic replace them."""
        kept: dict[str, list[tuple[int, bytes]]] = {}
        for topic, time_ns, data in messages:
            kept.setdefault(topic, []).append((time_ns, data))
        with self._lock:
            self._kept |= kept
        for topic in kept:
            self.send_again(topic)

    def send_again(self, topic: str, client: int | None = None) -> None:
        """Send the kept messages of a topic to all clients, or to one."""
        with self._lock:
            kept = list(self._kept.get(topic, ()))
        for time_ns, data in kept:
            self._channels[topic].log(data, log_time=time_ns, sink_id=client)

    def close(self) -> None:
        """Stop serving."""
        self._server.stop()


class _Listener:
    """Sends the kept messages to every new listener."""

    def __init__(self, server: LiveServer) -> None:
        self._server = server

    def on_subscribe(self, client: Any, channel: Any) -> None:
        self._server.send_again(channel.topic, client.id)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("on_"):
            return lambda *_: None
        raise AttributeError(name)
