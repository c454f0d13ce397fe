"""The studio's server: how its socket and its threads are set."""

from __future__ import annotations

import socket
import sys
from pathlib import Path
from typing import Any

import pytest
import uvicorn
from bimvox_pipeline.studio.serve import serve


def test_an_answer_is_sent_at_once_and_a_picture_does_not_hold_up_a_try(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[Any] = []

    def run(_: uvicorn.Server, sockets: list[socket.socket]) -> None:
        with socket.create_connection(sockets[0].getsockname()), sockets[0].accept()[0] as accepted:
            seen.append(accepted.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY))
        seen.append(sys.getswitchinterval())

    usual_s = sys.getswitchinterval()
    monkeypatch.setattr(uvicorn.Server, "run", run)
    try:
        serve(tmp_path, browser=False, ready=lambda _: None)
    finally:
        sys.setswitchinterval(usual_s)
    no_delay, switch_s = seen
    assert no_delay
    assert switch_s < usual_s
