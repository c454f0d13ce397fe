"""The plan that stands, told as it changes and as it is carried out: to viewers (``--serve``), and to a growing log."""

from __future__ import annotations

import contextlib
import re
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from bimvox.errors import InputError
from bimvox.progress import Progress

if TYPE_CHECKING:
    from bimvox.log.live.log import LiveLog
    from bimvox.log.live.server import LiveServer
    from bimvox.log.live.view import Moving
    from bimvox.log.plan_log import PlanLog
    from bimvox.stop.redirect import Held
    from bimvox_pipeline.watch.simulate import PlanClock

_TICK_S = 0.1
_HOST = "127.0.0.1"
_PORTS = 65536
KEPT_LIVE_LOGS = 5
"""Live logs that hold something, with the one that grows; older ones are removed when a watch begins."""


def address_of(text: str) -> tuple[str, int]:
    """Return host and port of ``[HOST:]PORT``.

    Raises:
        InputError: If it is neither.
    """
    host, _, port = text.rpartition(":")
    if not port.isdigit() or int(port) >= _PORTS:
        raise InputError(f"--serve {text}: not a port, or a host and a port", hint="for example --serve 8765")
    return host or _HOST, int(port)


def server_at(address: str, progress: Progress) -> LiveServer:
    """Return a server of ``[HOST:]PORT``, and say where it is.

    Raises:
        InputError: If the address is none, or nothing can be served there.
    """
    from bimvox.log.live.server import LiveServer

    server = LiveServer(*address_of(address))
    progress.note(f"viewers may look on at ws://{server.address}")
    return server


class Sink(Protocol):
    """Where messages go."""

    def keep(self, messages: Sequence[tuple[str, int, bytes]]) -> None:
        """Take what stays until it is sent again: topic, time (ns), data."""

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
        first: Digest of the plan that the watch began with.
    """

    def __init__(self, target: Path, progress: Progress, cranes: int, first: str) -> None:
        self._target, self._progress, self._cranes, self._first = target, progress, cranes, first
        self._log: LiveLog | None = None
        self._open()

    def keep(self, messages: Sequence[tuple[str, int, bytes]]) -> None:
        """Write what stays until it is sent again; where the log had to end, one begins with it if there is room."""
        if self._log is None:
            self._open()
        for topic, time_ns, data in messages:
            self.send(topic, time_ns, data)

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

    def _open(self) -> None:
        from bimvox.log import schema as topics
        from bimvox.log.live.log import LiveLog
        from bimvox.log.segments import FIRST_PLAN

        earlier = live_logs(self._target)
        name = f"{self._target.stem}.live{max(earlier, default=-1) + 1:04d}{self._target.suffix}"
        path = self._target.resolve().with_name(name)
        metadata = {topics.METADATA: {"schema_version": str(topics.SCHEMA_VERSION), FIRST_PLAN: self._first}}
        try:
            self._log = LiveLog(path, metadata, {}, cranes=self._cranes)
        except OSError as error:
            with contextlib.suppress(OSError):
                path.unlink(missing_ok=True)
            self._fail(error)
        else:
            self._remove_old(earlier)

    def _remove_old(self, earlier: dict[int, Path]) -> None:
        """Remove what is older than the newest few that hold something; what holds nothing stands in for none."""
        holding = [number for number, path in earlier.items() if _last_ns(path) is not None]
        if len(holding) < KEPT_LIVE_LOGS:
            return  # with the new one there are no more than that
        old = [path for number, path in earlier.items() if number < holding[1 - KEPT_LIVE_LOGS]]
        for path in old:
            with contextlib.suppress(OSError):
                path.unlink()
        self._progress.note(f"{len(old)} live logs of the oldest runs are removed, the newest {KEPT_LIVE_LOGS} kept")

    def _fail(self, error: OSError) -> None:
        """The plan goes on; the segments hold it."""
        why = error.strerror or error
        self._progress.note(f"the live log ends here: {why}; another begins when something changes and there is room")
        self._log = None


def live_logs(target: Path) -> dict[int, Path]:
    """Return the live logs beside a plan's whole log by number, ascending."""
    pattern = re.compile(re.escape(target.stem) + r"\.live(\d{4,})" + re.escape(target.suffix))
    folder = target.resolve().parent
    return dict(sorted((int(m.group(1)), p) for p in folder.iterdir() if (m := pattern.fullmatch(p.name))))


def driven_until_ns(target: Path, first: str) -> int:
    """Return how far the site's clock had come when the last run of the watch ended, by its live log; 0 where none.

    Args:
        target: The whole log of the plan.
        first: Digest of the plan that the watch began with; live logs of other plans do not count.
    """
    for path in reversed(live_logs(target).values()):
        # A run that was killed at once, or had no room on the disk, left nothing: the one before it knows.
        if (last_ns := _last_ns(path, first)) is not None:
            return last_ns
    return 0


def _last_ns(path: Path, first: str | None = None) -> int | None:
    """Time of the last message in a live log (of a plan); None where there is none, or it cannot be read."""
    from bimvox.log.live.log import driven_of
    from bimvox.log.segments import FIRST_PLAN

    try:
        driven = driven_of(path)
    except OSError:
        return None
    return None if first is not None and driven.metadata.get(FIRST_PLAN) != first else driven.last_ns


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

    def show(self, record: PlanLog, held: Sequence[Held] = ()) -> None:
        """Show a plan from now on.

        Args:
            record: The plan, with the motions whose time is known, and what happened to it.
            held: The lifts whose loads are held.
        """
        from bimvox.log.live.view import Moving, standing_messages, with_held

        for one in held:
            record = with_held(record, one)
        hanging = [one.lift.component for one in held if one.stop is not None]
        with self._lock:
            now_ns = self._now_ns()
            standing = standing_messages(record, now_ns, hanging)
            messages = [(topic, at_ns, one.SerializeToString(deterministic=True)) for at_ns, topic, one in standing]
            moving = Moving(record)
            if self._clock is None:
                # Nothing moves: whoever begins to look on later is to see the cranes too.
                messages += [(topic, now_ns, data) for topic, data in moving.at(now_ns)]
            for sink in self._sinks:
                sink.keep(messages)
            self._moving = moving
        if self._clock is None:
            return
        self._tick()
        if self._thread is None:
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
