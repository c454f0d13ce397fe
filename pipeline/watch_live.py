"""The plan that stands, told as it changes and as it is carried out: to viewers (``--serve``), and to a growing log."""

from __future__ import annotations

import re
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from bimvox.errors import InputError
from pipeline.progress import Progress

if TYPE_CHECKING:
    from bimvox.log.live_server import Moving
    from bimvox.log.merge import Timed
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


class Sink(Protocol):
    """Where messages go."""

    def keep(self, messages: list[Timed]) -> None:
        """Take what stays until it is sent again."""

    def send(self, topic: str, time_ns: int, data: bytes) -> None:
        """Take what moves."""

    def close(self) -> None:
        """Nothing more comes."""


class DrivenLog:
    """A log of what is driven while it is driven: ``kill -9`` costs less than a second of it.

    Args:
        target: The whole log of the plan; every run of the watch has a live log of its own beside it.
        progress: Told where it cannot be written.
        cranes: How many cranes there are.
    """

    def __init__(self, target: Path, progress: Progress, cranes: int = 1) -> None:
        from bimvox.log import topics
        from bimvox.log.live import LiveLog

        earlier = live_logs(target)
        number = max(earlier, default=-1) + 1
        self._progress, self._log = progress, None
        path = target.resolve().with_name(f"{target.stem}.live{number:04d}{target.suffix}")
        try:
            metadata = {topics.METADATA: {"schema_version": str(topics.SCHEMA_VERSION)}}
            self._log = LiveLog(path, metadata, {}, cranes=cranes)
        except OSError as error:
            self._fail(error)

    def keep(self, messages: list[Timed]) -> None:
        """Write what stays until it is sent again."""
        for time_ns, topic, message in messages:
            self.send(topic, time_ns, message.SerializeToString(deterministic=True))

    def send(self, topic: str, time_ns: int, data: bytes) -> None:
        """Write what moves."""
        if self._log is None:
            return
        try:
            self._log.serialized(topic, time_ns, data)
        except OSError as error:
            self._fail(error)

    def close(self) -> None:
        """Write the end and the index."""
        if self._log is not None:
            try:
                self._log.close()
            except OSError as error:
                self._fail(error)

    def _fail(self, error: OSError) -> None:
        """The plan goes on; the segments hold it."""
        self._progress.note(f"the live log ends here: {error.strerror or error}")
        self._log = None


def live_logs(target: Path) -> dict[int, Path]:
    """Return the live logs beside a plan's whole log by number, ascending."""
    pattern = re.compile(re.escape(target.stem) + r"\.live(\d{4,})" + re.escape(target.suffix))
    folder = target.resolve().parent
    return dict(sorted((int(m.group(1)), p) for p in folder.iterdir() if (m := pattern.fullmatch(p.name))))


def driven_until_ns(target: Path) -> int:
    """Return how far the site's clock had come when the last run of the watch ended, by its live log; 0 where none."""
    from bimvox.log.live import last_time_ns

    logs = live_logs(target)
    return (last_time_ns(logs[max(logs)]) or 0) if logs else 0


class LiveView:
    """Sends what stands at every revision, and what moves ten times a second while the plan is carried out.

    Args:
        sinks: Where to.
        clock: The site's clock; None where the plan is not carried out.
    """

    def __init__(self, sinks: Sequence[Sink], clock: PlanClock | None) -> None:
        self._sinks, self._clock = sinks, clock
        self._moving: Moving | None = None
        self._lock = threading.Lock()
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None

    def show(self, record: PlanLog) -> None:
        """Show a plan from now on."""
        from bimvox.log.live_server import Moving, standing_messages

        with self._lock:
            now_ns = self._now_ns()
            messages = list(standing_messages(record, now_ns))
            for sink in self._sinks:
                sink.keep(messages)
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
        for sink in self._sinks:
            sink.close()

    def _run(self) -> None:
        while not self._stop.wait(_TICK_S):
            self._tick()

    def _tick(self) -> None:
        with self._lock:
            now_ns = self._now_ns()
            for topic, data in self._moving.at(now_ns) if self._moving is not None else ():
                for sink in self._sinks:
                    sink.send(topic, now_ns, data)

    def _now_ns(self) -> int:
        return 0 if self._clock is None else self._clock.now_ns
