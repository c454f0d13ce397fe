"""What a viewer shows of a plan at one time: standing messages, and moving ones."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import replace

import numpy as np

from bimvox.log import schema as topics
from bimvox.log.mcap.rows import Rows, Timed
from bimvox.log.moving import lift_rows
from bimvox.log.narration import event_messages
from bimvox.log.plan_log import PlanLog
from bimvox.log.planned_path import path_message
from bimvox.log.scene import SceneUpdates
from bimvox.log.states import states_at
from bimvox.log.track import crane_track
from bimvox.log.voxels import voxel_grid
from bimvox.records.motion import LiftMotion
from bimvox.site.construction import ConstructionState
from bimvox.stop.redirect import Held
from bimvox.stop.resume import cut_short


def last_begun(motions: Collection[LiftMotion], time_ns: int) -> dict[int, LiftMotion]:
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
    yield time_ns, topics.SCENE, scene.afresh(time_ns)
    by_order = {lift.order: lift for lift in lifts}
    under_way = [motion for motion in last_begun(record.motions, time_ns).values() if motion.end_ns > time_ns]
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
        for crane, motion in sorted(last_begun(self._record.motions, time_ns).items()):
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
