"""The log's topics on a websocket, for live viewers (Foxglove and others that use its protocol).

The same topics, schemas and bytes as in a log. A new viewer first gets the standing messages (cells, scene, paths,
events). Only who knows the token in the address may connect (``admission``). A slow viewer gets the newest states; one
that takes nothing for ten seconds is dropped. The server of the Foxglove SDK is not used: it asks for no token, checks
no origin, admits any number of viewers, and bounds their queues by messages instead of bytes (version 0.30). Needs
``pip install 'bimvox[live]'``.
"""

from __future__ import annotations

import asyncio
import base64
import hmac
import json
import logging
import re
import secrets
import socket
import threading
from collections.abc import Iterable, Sequence
from http import HTTPStatus
from typing import TYPE_CHECKING, Any

from bimvox.errors import InputError
from bimvox.log import schema as topics
from bimvox.log.live.viewer import PIECE_BYTES, Message, Viewer

if TYPE_CHECKING:
    from websockets.asyncio.server import Server, ServerConnection
    from websockets.http11 import Request, Response

TOKEN_VARIABLE = "BIMVOX_SERVE_TOKEN"
"""Environment variable with a token of one's own, for an address that stays the same."""

_ORIGINS = ("https://app.foxglove.dev", "https://studio.foxglove.dev", "file://")
"""Origins of viewers; desktop programs give ``file://`` or none. Pages of this machine are allowed too."""

_THIS_MACHINE = re.compile(r"https?://(localhost|127\.0\.0\.1|\[::1\])(:\d{1,5})?")
_TOKEN = re.compile(r"[A-Za-z0-9_-]{16,128}")
_TOKEN_BYTES = 18


def token_of(given: str | None) -> str:
    """Return the given token, or a random one if none is given.

    Raises:
        InputError: If the given token is too short, or cannot be part of an address.
    """
    if not given:
        return secrets.token_urlsafe(_TOKEN_BYTES)
    if not _TOKEN.fullmatch(given):
        raise InputError(
            f"{TOKEN_VARIABLE}: not a token of 16 to 128 letters, digits, '-' and '_'",
            hint=f"unset {TOKEN_VARIABLE}; then bimvox makes a random token",
        )
    return given


def refusal(path: str, origins: Sequence[str], token: str) -> tuple[HTTPStatus, str] | None:
    """Return why a request is refused; None if it may connect.

    Args:
        path: Path and query of the request.
        origins: The values of its Origin headers.
        token: The server's token: the path must be ``/TOKEN``.
    """
    given = path.partition("?")[0].encode("utf-8", "surrogateescape")
    if not hmac.compare_digest(given, f"/{token}".encode()):
        return HTTPStatus.UNAUTHORIZED, "The token is missing or wrong: use the whole address that bimvox printed.\n"
    if len(origins) > 1 or not all(origin in _ORIGINS or _THIS_MACHINE.fullmatch(origin) for origin in origins):
        return HTTPStatus.FORBIDDEN, "Pages of this origin may not connect.\n"
    return None


MAX_VIEWERS = 128
"""Viewers at one time; further ones are refused."""

MAX_PENDING = 32
"""Connections at one time that have not shown the token; if more are opened, the oldest are closed."""

BUFFER_BYTES = 1 << 18
"""Bytes in the socket's buffer above which a viewer is dropped: it makes requests and does not read the answers."""

_REQUEST_BYTES = 1 << 16
_STALLED_S = 10.0
_LOOK_EVERY_S = 0.5
_PROTOCOLS = ("foxglove.sdk.v1", "foxglove.websocket.v1")
_INFO = json.dumps({"op": "serverInfo", "name": "bimvox watch", "capabilities": [], "metadata": {}})
_QUIET = logging.Logger("bimvox live", logging.CRITICAL + 1)  # viewers come and go; that is not worth a line


class LiveServer:
    """Serves the topics, after ``advertise`` has set the number of cranes; thread-safe.

    Args:
        host: The address to listen on.
        port: The port; 0 for any free port.
        token: What a viewer must know.

    Attributes:
        url: The address for viewers, with the token.

    Raises:
        InputError: If the package is not installed, or the port cannot be opened.
    """

    def __init__(self, host: str, port: int, token: str) -> None:
        try:
            import websockets.asyncio.server  # noqa: F401
        except ImportError:
            raise InputError(
                "a live server needs the package websockets, which is not installed", hint="pip install 'bimvox[live]'"
            ) from None
        self._token, self._at_once = token, 1
        self._announced: list[str] = []
        self._topics: dict[int, str] = {}
        self._kept: dict[str, list[Message]] = {}
        self._viewers: set[Viewer] = set()
        self._pending: dict[ServerConnection, None] = {}  # in the order in which they were opened
        self._loop = asyncio.new_event_loop()
        self._loop.set_exception_handler(_without_lost_sockets)
        self._thread = threading.Thread(target=self._loop.run_forever, name="live server", daemon=True)
        self._thread.start()
        try:
            self._server = self._call(self._open(host, port))
        except (OSError, ValueError) as error:
            self._end()
            raise InputError(f"cannot serve on {host}:{port}: {error}", hint="choose another port") from error
        named = f"[{host}]" if ":" in host else host
        self.url = f"ws://{named}:{next(iter(self._server.sockets)).getsockname()[1]}/{token}"

    @property
    def viewers(self) -> int:
        """How many viewers are connected."""
        return len(self._viewers)

    def queued_bytes(self) -> int:
        """Return the most bytes that wait for one viewer."""

        async def most() -> int:
            return max((viewer.queued_bytes for viewer in self._viewers), default=0)

        return int(self._call(most()))

    def advertise(self, cranes: int) -> None:
        """Announce the topics of a log of a site with this many cranes."""
        shown = (topic for topic in topics.topics_of(cranes) if topic is not topics.MOTION_TOPIC)
        named = list(enumerate(shown, start=1))
        channels = [
            {
                "id": number,
                "topic": topic.name,
                "encoding": "protobuf",
                "schemaName": topic.schema,
                "schemaEncoding": "protobuf",
                "schema": base64.b64encode(topic.descriptor_set_for(several_cranes=cranes > 1)).decode(),
            }
            for number, topic in named
        ]
        text = json.dumps({"op": "advertise", "channels": channels})
        self._soon(self._announce, text, {number: topic.name for number, topic in named}, cranes)

    def send(self, topic: str, time_ns: int, data: bytes) -> None:
        """Send a message to all viewers that have subscribed."""
        self._soon(self._add, Message(topic, time_ns, data))

    def keep(self, messages: Iterable[tuple[str, int, bytes]]) -> None:
        """Send messages, and send them again to every new viewer, until others of their topic replace them."""
        kept: dict[str, list[Message]] = {}
        for topic, time_ns, data in messages:
            kept.setdefault(topic, []).append(Message(topic, time_ns, data))
        self._soon(self._keep, kept)

    def close(self) -> None:
        """Stop serving; viewers are disconnected."""

        async def close() -> None:
            self._looking.cancel()
            self._server.close(close_connections=False)
            for viewer in self._viewers:
                viewer.drop()
            await self._server.wait_closed()

        self._call(close())
        self._end()

    async def _open(self, host: str, port: int) -> Server:
        from websockets.asyncio.server import ServerConnection, serve
        from websockets.typing import Subprotocol

        pending = self._pending

        class Counted(ServerConnection):
            """A connection that is among the pending ones until it is admitted or closed."""

            def connection_made(self, transport: asyncio.BaseTransport) -> None:
                super().connection_made(transport)
                pending[self] = None
                if len(pending) > MAX_PENDING:
                    oldest = next(iter(pending))
                    del pending[oldest]
                    oldest.transport.abort()

            def connection_lost(self, exc: Exception | None) -> None:
                pending.pop(self, None)
                super().connection_lost(exc)

        server = await serve(
            self._serve,
            host,
            port,
            process_request=self._admit,
            create_connection=Counted,
            subprotocols=[Subprotocol(name) for name in _PROTOCOLS],
            compression=None,
            max_size=_REQUEST_BYTES,
            write_limit=PIECE_BYTES,
            logger=_QUIET,
        )
        for listening in server.sockets:  # connections inherit it; without it the system keeps megabytes for each
            listening.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, BUFFER_BYTES)
        self._looking = self._loop.create_task(self._look())
        return server

    def _admit(self, connection: ServerConnection, request: Request) -> Response | None:
        if (why := refusal(request.path, request.headers.get_all("Origin"), self._token)) is not None:
            return connection.respond(*why)
        if len(self._viewers) >= MAX_VIEWERS:
            return connection.respond(HTTPStatus.SERVICE_UNAVAILABLE, "Too many viewers are connected.\n")
        return None

    async def _serve(self, connection: ServerConnection) -> None:
        self._pending.pop(connection, None)
        viewer = Viewer(connection, self._topics, lambda topic: self._kept.get(topic, ()))
        viewer.text(_INFO)
        for text in self._announced:
            viewer.text(text)
        self._viewers.add(viewer)
        try:
            await viewer.serve()
        finally:
            self._viewers.discard(viewer)

    async def _look(self) -> None:
        """Drop the viewers that take nothing."""
        while True:
            await asyncio.sleep(_LOOK_EVERY_S)
            for viewer in list(self._viewers):
                if viewer.waiting_s(self._loop.time()) > _STALLED_S or viewer.buffered_bytes > BUFFER_BYTES:
                    viewer.drop()

    def _announce(self, text: str, named: dict[int, str], cranes: int) -> None:
        self._topics |= named
        self._at_once = cranes
        self._announced.append(text)
        for viewer in self._viewers:
            viewer.text(text)

    def _add(self, message: Message) -> None:
        for viewer in self._viewers:
            viewer.add(message, self._at_once)

    def _keep(self, kept: dict[str, Sequence[Message]]) -> None:
        self._kept |= {topic: list(messages) for topic, messages in kept.items()}
        for viewer in self._viewers:
            for topic, messages in kept.items():
                viewer.keep(topic, messages)

    def _call(self, work: Any) -> Any:
        """Return the result of work that the server's thread does."""
        return asyncio.run_coroutine_threadsafe(work, self._loop).result()

    def _soon(self, work: Any, *arguments: Any) -> None:
        self._loop.call_soon_threadsafe(work, *arguments)

    def _end(self) -> None:
        self._soon(self._loop.stop)
        self._thread.join()
        self._loop.close()


def _without_lost_sockets(loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
    """Report what goes wrong in the server's thread, except what the system refuses to a socket: it is tried again."""
    if not isinstance(context.get("exception"), OSError):
        loop.default_exception_handler(context)
