"""``bimvox watch --serve``: the plan that stands, shown to viewers as it changes and as it is carried out."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

from bimvox.errors import InputError

if TYPE_CHECKING:
    from bimvox.log.live_server import LiveServer, Moving
    from bimvox.log.plan_log import PlanLog
    from pipeline.simulate import PlanClock

_TICK_S = 0.1
_HOST = "127.0.0.1"
_PORTS = 65536


def address_of(text: str) -> tuple[str, int]:
    """Return host and port of ``[HOST:]PORT``.

    Raises:
        InputError: If it is neither.
    """
    host, _, port = text.rpartition(":")
    if not port.isdigit() or int(port) >= _PORTS:
        raise InputError(f"--serve {text}: not a port, or a host and a port", hint="for example --serve 8765")
    return host or _HOST, int(port)


class LiveView:
    """Sends what stands at every revision, and what moves ten times a second while the plan is carried out.

    Args:
        server: Where to.
        clock: The site's clock; None where the plan is not carried out.
    """

    def __init__(self, server: LiveServer, clock: PlanClock | None) -> None:
        self._server, self._clock = server, clock
        self._moving: Moving | None = None
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None

    def show(self, record: PlanLog) -> None:
        """Show a plan from now on."""
        from bimvox.log.live_server import Moving, standing_messages

        now_ns = self._now_ns()
        self._server.keep(list(standing_messages(record, now_ns)))
        self._moving = Moving(record)
        self._tick()
        if self._clock is not None and self._thread is None:
            self._thread = threading.Thread(target=self._run, name="live", daemon=True)
            self._thread.start()

    def close(self) -> None:
        """Stop sending."""
        self._stop.set()
        if self._thread is not None:
            self._thread.join()
        self._server.close()

    def _run(self) -> None:
        while not self._stop.wait(_TICK_S):
            self._tick()

    def _tick(self) -> None:
        moving, now_ns = self._moving, self._now_ns()
        if moving is not None:
            for topic, data in moving.at(now_ns):
                self._server.send(topic, now_ns, data)

    def _now_ns(self) -> int:
        return 0 if self._clock is None else self._clock.now_ns
