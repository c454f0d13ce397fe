"""A growing log that survives whatever ends the process.

A separate thread closes a chunk and hands it to the system at least every half second of wall time, so that a killed
process loses less than a second; ``bimvox export --recover`` reads the rest. When closed, the log gets its index and is
like any other log, except that the sizes of its chunks depend on the wall clock.
"""

from __future__ import annotations

import contextlib
import os
import struct
import threading
from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Metadata
from mcap.stream_reader import MAGIC_SIZE

from bimvox.log import schema as topics
from bimvox.log.mcap.packed import Rows, Timed
from bimvox.log.mcap.writer import RECORD_HEAD, LogWriter
from bimvox.log.moving import lift_rows, path_message
from bimvox.log.narration import event_messages
from bimvox.log.plan_log import PlanLog
from bimvox.log.scene import SceneUpdates, states_at
from bimvox.log.schema import METADATA
from bimvox.log.track import crane_track
from bimvox.log.transforms import voxel_grid
from bimvox.records.motion import LiftMotion, stays_of
from bimvox.site.component import ConstructionState
from bimvox.stop.redirect import Held
from bimvox.stop.resume import cut_short

_TIMES = struct.Struct("<QQ")  # of a chunk: first and last time

CHUNK_S = 0.4
"""Wall time after which a chunk is closed; with the writing itself this stays within half a second."""


class LiveLog:
    """A growing log; thread-safe.

    Args:
        path: The output; an existing file is replaced.
        metadata: Metadata records, written first.
        attachments: Files by name, written after the metadata.
        cranes: How many cranes there are.
        every_s: Maximum wall time between two chunks.
    """

    def __init__(
        self,
        path: Path | str,
        metadata: Mapping[str, Mapping[str, str]],
        attachments: Mapping[str, bytes],
        *,
        cranes: int = 1,
        every_s: float = CHUNK_S,
    ) -> None:
        self._stream = Path(path).open("wb")  # noqa: SIM115 (open while the log is)
        self._writer = LogWriter(self._stream, cranes)
        self._lock = threading.Lock()
        self._closed = threading.Event()
        self._failure: OSError | None = None
        try:
            for name, values in metadata.items():
                self._writer.metadata(name, values)
            for name, data in attachments.items():
                self._writer.attachment(name, data)
            self._save()
        except OSError:
            with contextlib.suppress(OSError):  # what failed to be written once will fail again
                self._stream.close()
            raise
        self._thread = threading.Thread(target=self._run, args=(every_s,), name="live log", daemon=True)
        self._thread.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def message(self, topic: str, time_ns: int, message: Any) -> None:
        """Write a message.

        Raises:
            OSError: If an earlier one could not be saved (disk full); the log ends before that one.
        """
        self.serialized(topic, time_ns, message.SerializeToString(deterministic=True))

    def serialized(self, topic: str, time_ns: int, data: bytes) -> None:
        """Write a serialized message.

        Raises:
            OSError: See ``message``.
        """
        with self._lock:
            if self._failure is not None:
                raise self._failure
            self._writer.serialized(topic, time_ns, data)

    def close(self) -> None:
        """Write the last chunk and the index.

        Raises:
            OSError: If these, or an earlier chunk, could not be saved.
        """
        if self._closed.is_set():
            return
        self._closed.set()
        self._thread.join()
        try:
            if self._failure is not None:
                raise self._failure
            self._writer.finish()
            self._stream.flush()
            os.fsync(self._stream.fileno())
        finally:
            self._stream.close()

    def _run(self, every_s: float) -> None:
        while not self._closed.wait(every_s):
            with self._lock:
                try:
                    self._save()
                except OSError as error:
                    self._failure = error
                    return

    def _save(self) -> None:
        self._writer.end_chunk()
        self._stream.flush()


class Driven(NamedTuple):
    """What a live log, closed or not, says about itself.

    Attributes:
        metadata: The values of its bimvox metadata record.
        last_ns: Time of the last message that survived; None if none did.
    """

    metadata: Mapping[str, str]
    last_ns: int | None


def driven_of(path: Path | str) -> Driven:
    """Return what a live log says about itself, without reading its messages.

    Raises:
        OSError: If it cannot be read.
    """
    metadata: dict[str, str] = {}
    last_ns = 0
    with Path(path).open("rb") as stream:
        size = os.fstat(stream.fileno()).st_size
        at = MAGIC_SIZE
        while at + RECORD_HEAD.size <= size:
            stream.seek(at)
            opcode, length = RECORD_HEAD.unpack(stream.read(RECORD_HEAD.size))
            at += RECORD_HEAD.size + length
            if at > size or opcode in (0, Opcode.DATA_END):
                break  # truncated, or the end
            if opcode == Opcode.CHUNK:
                last_ns = max(last_ns, _TIMES.unpack(stream.read(_TIMES.size))[1])
            elif opcode == Opcode.METADATA:
                record = Metadata.read(ReadDataStream(BytesIO(stream.read(length))))
                if record.name == METADATA:
                    metadata = record.metadata
    return Driven(metadata, last_ns or None)


# What a viewer shows of a plan at one time: standing messages, and moving ones.


def _last_begun(motions: Collection[LiftMotion], time_ns: int) -> dict[int, LiftMotion]:
    """Return the motion that each crane has begun last by a time, by the crane's index; others are missing."""
    begun = [motion for motion in motions if motion.start_ns <= time_ns]
    return {motion.crane: motion for motion in sorted(begun, key=lambda motion: motion.start_ns)}


def with_held(record: PlanLog, held: Held) -> PlanLog:
    """Return the record with the held lift as far as it was driven: its load hangs where it came to rest.

    Args:
        record: The plan, in which the lift is infeasible meanwhile.
        held: The lift; if its load was not carried, the record keeps the lift as it is.
    """
    if held.stop is None:
        return record
    lifts = tuple(held.lift if lift.order == held.lift.order else lift for lift in record.plan.lifts)
    motions = (*(m for m in record.motions if m.order != held.lift.order), cut_short(held.motion, held.stop))
    return replace(record, plan=replace(record.plan, lifts=lifts), motions=motions)


def standing_messages(record: PlanLog, time_ns: int, hanging: Collection[int] = ()) -> Iterator[Timed]:
    """Yield the standing messages: the cells, the scene at a time, the paths of the lifts at that time, the events.

    Args:
        record: The plan, with the motions whose time is known.
        time_ns: Time on the site's clock.
        hanging: Components held on a hook, whatever their motions say.
    """
    site, lifts = record.plan.site, record.all_lifts
    yield time_ns, topics.VOXELS, voxel_grid(site, time_ns)
    scene = SceneUpdates(site, {lift.component: lift for lift in lifts}, {})
    if site.moving is not None:
        stays = [stay for stay in stays_of(record.motions) if stay.from_ns <= time_ns]
        scene.set_up = stays[-1].crane if stays else scene.set_up
    yield time_ns, topics.SCENE, scene.afresh(time_ns)
    by_order = {lift.order: lift for lift in lifts}
    under_way = [motion for motion in _last_begun(record.motions, time_ns).values() if motion.end_ns > time_ns]
    tracks = [crane_track(site, by_order[motion.order], motion) for motion in under_way]
    for track in tracks:
        yield path_message(site, track.lift, time_ns)
    states = states_at(lifts, record.motions, tracks, time_ns)
    states |= dict.fromkeys(hanging, ConstructionState.IN_TRANSIT)
    if (update := scene.change(states, time_ns)) is not None:
        yield time_ns, topics.SCENE, update
    for _, topic, message in event_messages(record, ()):
        yield time_ns, topic, message


class Moving:
    """The moving messages at any time: every crane's frames, joints, load and commands.

    Args:
        record: The plan, with the motions whose time is known.
    """

    def __init__(self, record: PlanLog) -> None:
        self._record = record
        self._rows: dict[int, tuple[int, list[Rows]]] = {}

    def at(self, time_ns: int) -> Iterator[tuple[str, bytes]]:
        """Yield the last message up to a time, of each topic of each crane's lift."""
        for crane, motion in sorted(_last_begun(self._record.motions, time_ns).items()):
            latest: dict[str, bytes] = {}
            for rows in self._rows_of(crane, motion):
                at = int(np.searchsorted(rows.time_ns, time_ns, side="right")) - 1
                if at >= 0:
                    latest[rows.topic] = rows.data[at]
            yield from latest.items()

    def _rows_of(self, crane: int, motion: LiftMotion) -> list[Rows]:
        order, rows = self._rows.get(crane, (-1, []))
        if order != motion.order:
            rows = lift_rows(self._record, motion)
            self._rows[crane] = motion.order, rows
        return rows
