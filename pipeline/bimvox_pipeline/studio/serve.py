"""Runs a studio until it is interrupted."""

from __future__ import annotations

import secrets
import socket
import sys
import webbrowser
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from urllib.parse import quote

import uvicorn

from bimvox.errors import InputError
from bimvox.files import reason_of, require_input
from bimvox_pipeline.studio.app import Studio, application

_HOST = "127.0.0.1"
_SWITCH_S = 0.001
"""A try does not wait longer than this, many times over, for a picture that another thread draws."""


def serve(
    path: Path | None = None, *, port: int = 0, browser: bool = True, ready: Callable[[str], object] = print
) -> None:
    """Serve the studio of a folder to this machine until it is interrupted.

    Args:
        path: A folder, or a site file or a model in it, which is opened first; default: the current folder.
        port: Port; 0: a free one.
        browser: Whether the address is opened in a browser.
        ready: Told the address as soon as the studio answers.

    Raises:
        FileError: If there is nothing at the path.
        InputError: If the port is taken.
    """
    there = Path() if path is None else path if path.is_dir() else require_input(path)
    folder = there if there.is_dir() else there.parent
    token = secrets.token_urlsafe(24)
    studio = Studio(folder, token)
    try:
        listening = socket.create_server((_HOST, port))
    except OSError as error:
        raise InputError(f"port {port}: {reason_of(error)}", hint="--port 0 takes a free one") from None
    # asyncio does this only for sockets that name their protocol; otherwise each answer waits 40 ms for the system.
    listening.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    with listening:
        port = listening.getsockname()[1]
        address = f"http://{_HOST}:{port}/?token={token}"
        if not there.is_dir():
            address += f"&open={quote(studio.folder.relative(there.resolve()))}"
        config = uvicorn.Config(
            application(studio, port), log_level="warning", access_log=False, lifespan="off", server_header=False
        )
        server = uvicorn.Server(config)
        sys.setswitchinterval(_SWITCH_S)
        ready(address)
        if browser:
            webbrowser.open(address)
        try:
            with suppress(KeyboardInterrupt):  # the way to end it
                server.run(sockets=[listening])
        finally:
            studio.jobs.end()
