"""Sends the current plan and its execution to viewers (``--serve``) and to a growing log."""

from __future__ import annotations

import contextlib
import ipaddress
import os
import re
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from bimvox.errors import InputError
from bimvox.log.live.log import LiveLog, Moving, driven_of, standing_messages, with_held
from bimvox.log.live.server import TOKEN_VARIABLE, token_of
from bimvox.log.plan_log import PlanLog
from bimvox.log.schema import METADATA, SCHEMA_VERSION
from bimvox.log.segments import FIRST_PLAN
from bimvox.progress import Progress
from bimvox.stop.redirect import Held
from bimvox.undisturbed import undisturbed
from bimvox_pipeline.watch.simulate import PlanClock

if TYPE_CHECKING:
    from bimvox.log.live.server import LiveServer

_TICK_S = 0.1
_HOST = "127.0.0.1"
_PORTS = 65536
KEPT_LIVE_LOGS = 5
"""Live logs that are kept, including the growing one; older ones are removed when a watch begins."""


def address_of(text: str) -> tuple[str, int]:
    """Return host and port of ``[HOST:]PORT``.

    Raises:
        InputError: If the text is not of this form.
    """
    host, _, port = text.rpartition(":")
    if not port.isdigit() or int(port) >= _PORTS:
        raise InputError(f"--serve {text}: not a port, or a host and a port", hint="for example --serve 8765")
    return host or _HOST, int(port)


def _is_this_machine(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def server_at(address: str, progress: Progress) -> LiveServer:
    """Return a server at ``[HOST:]PORT``, and note its address, which holds the token.

    Raises:
        InputError: If the address is malformed or cannot be used.
    """
    from bimvox.log.live.server import LiveServer  # needs the optional package websockets

    host, port = address_of(address)
    server = LiveServer(host, port, token_of(os.environ.get(TOKEN_VARIABLE)))
    progress.note(f"viewers can connect to {server.url}")
    if not _is_this_machine(host):
        progress.note("the live server is open to the network: whoever has this address can look on")
    return server


class Sink(Protocol):
    """A receiver of messages."""

    def keep(self, messages: Sequence[tuple[str, int, bytes]]) -> None:
        """Take messages that are valid until they are sent again: topic, time (ns), data."""

    def send(self, topic: str, time_ns: int, data: bytes) -> None:
        """Take a message about something that moves."""

    def close(self) -> None:
        """End: no message follows."""


class DrivenLog:
    """A log of the execution that is written as it happens: ``kill -9`` loses less than a second.

    Args:
        target: The whole log of the plan; every run of the watch writes its own live log next to it.
        progress: Receives failures.
        cranes: Number of cranes.
        first: Digest of the plan with which the watch began.
    """

    def __init__(self, target: Path, progress: Progress, cranes: int, first: str) -> None:
        self._target, self._progress, self._cranes, self._first = target, progress, cranes, first
        self._log: LiveLog | None = None
        self._open()

    def keep(self, messages: Sequence[tuple[str, int, bytes]]) -> None:
        """Write messages that are valid until they are sent again; if the log has failed, try to begin a new one."""
        if self._log is None:
            self._open()
        for topic, time_ns, data in messages:
            self.send(topic, time_ns, data)

    def send(self, topic: str, time_ns: int, data: bytes) -> None:
        """Write a message about something that moves."""
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
        earlier = live_logs(self._target)
        name = f"{self._target.stem}.live{max(earlier, default=-1) + 1:04d}{self._target.suffix}"
        path = self._target.resolve().with_name(name)
        metadata = {METADATA: {"schema_version": str(SCHEMA_VERSION), FIRST_PLAN: self._first}}
        try:
            self._log = LiveLog(path, metadata, {}, cranes=self._cranes)
        except OSError as error:
            with contextlib.suppress(OSError):
                path.unlink(missing_ok=True)
            self._fail(error)
        else:
            self._remove_old(earlier)

    def _remove_old(self, earlier: dict[int, Path]) -> None:
        """Remove all but the newest logs; empty logs do not count as kept."""
        holding = [number for number, path in earlier.items() if _last_ns(path) is not None]
        if len(holding) < KEPT_LIVE_LOGS:
            return
        old = [path for number, path in earlier.items() if number < holding[1 - KEPT_LIVE_LOGS]]
        for path in old:
            with contextlib.suppress(OSError):
                path.unlink()
        self._progress.note(f"{len(old)} live logs of the oldest runs are removed, the newest {KEPT_LIVE_LOGS} kept")

    def _fail(self, error: OSError) -> None:
        """End the log; the plan continues, and its segments are complete."""
        why = error.strerror or error
        self._progress.note(f"the live log stops: {why}; a new one begins at the next change for which there is room")
        self._log = None


def live_logs(target: Path) -> dict[int, Path]:
    """Return the live logs next to a plan's whole log by number, ascending."""
    pattern = re.compile(re.escape(target.stem) + r"\.live(\d{4,})" + re.escape(target.suffix))
    folder = target.resolve().parent
    return dict(sorted((int(m.group(1)), p) for p in folder.iterdir() if (m := pattern.fullmatch(p.name))))


def driven_until_ns(target: Path, first: str) -> int:
    """Return the time on the site's clock at the end of the last live log; 0 if there is none.

    Args:
        target: The whole log of the plan.
        first: Digest of the plan with which the watch began; live logs of other plans do not count.
    """
    for path in reversed(live_logs(target).values()):
        # The log of a run that was killed at once, or had no room on the disk, is empty: the one before it counts.
        if (last_ns := _last_ns(path, first)) is not None:
            return last_ns
    return 0


def _last_ns(path: Path, first: str | None = None) -> int | None:
    """Return the time of the last message in a live log of a plan; None if there is none or it cannot be read."""
    try:
        driven = driven_of(path)
    except OSError:
        return None
    return None if first is not None and driven.metadata.get(FIRST_PLAN) != first else driven.last_ns


class LiveView:
    """Sends the plan at every revision, and the motion ten times a second while the plan is carried out.

    Args:
        sinks: The receivers.
        clock: The site's clock; None if the plan is not carried out.
    """

    def __init__(self, sinks: Sequence[Sink], clock: PlanClock | None) -> None:
        self._sinks, self._clock = sinks, clock
        self._moving: Moving | None = None
        self._lock = threading.Lock()
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None

    @undisturbed()
    def show(self, record: PlanLog, held: Sequence[Held] = ()) -> None:
        """Show a plan from now on.

        Args:
            record: The plan with its timed motions and its events.
            held: The lifts whose loads are held.
        """
        for one in held:
            record = with_held(record, one)
        hanging = [one.lift.component for one in held if one.stop is not None]
        with self._lock:
            now_ns = self._now_ns()
            standing = standing_messages(record, now_ns, hanging)
            messages = [(topic, at_ns, one.SerializeToString(deterministic=True)) for at_ns, topic, one in standing]
            moving = Moving(record)
            if self._clock is None:
                # Nothing moves: a viewer that connects later must see the cranes too.
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
        with undisturbed():
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
