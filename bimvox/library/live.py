"""The lifts of a plan as a job of the environment ``bimvox/LiveSite-v0``: carried out among people and lorries."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from bimvox.library.arguments import insist, path_of, whole
from bimvox.library.plan_value import Plan
from bimvox.library.prove import prepared
from bimvox.live.job import LiveJob
from bimvox.live.planned import job_of
from bimvox.live.tracks import read_tracks, with_tracks
from bimvox.progress import Listener, progress_of


def live_job(
    plan: Plan,
    *,
    first: int = 1,
    count: int = 30,
    ways: int = 1,
    tracks: Path | str | None = None,
    progress: Listener = None,
) -> LiveJob:
    """Return planned lifts that follow each other as a job for a site that moves.

    ``gymnasium.make("bimvox/LiveSite-v0", job=...)`` takes it. Each lift has the motion of the plan as its way, and
    others that lead around it, if there are any. Lifts may change places where the proofs of their ways allow it.

    Args:
        plan: A plan of a site with one crane, made or read from a log.
        first: Which of the planned lifts is the first one, from 1.
        count: How many lifts, at most, from 1.
        ways: How many proven ways of each lift, at most, from 1; each further one is searched, timed and proven.
        tracks: A file with the tracks of people and vehicles: CSV with the columns ``id,kind,time_s,x_m,y_m``, or JSON,
            ``{"tracks": [{"id": ..., "kind": ..., "samples": [[time_s, x_m, y_m], ...]}, ...]}``; None: there are none.
        progress: A ``Progress``, or a function that takes a line of text.

    Raises:
        InputError: If an argument is of another kind or out of range, the site has several cranes or none, or there is
            no such lift.
        FileError: If the tracks cannot be used; names the line or the key.
    """
    insist("live_job", plan, Plan, "plan")
    told, begin, most = progress_of(progress), whole("first", first, 1) or 1, whole("count", count, 1) or 1
    ways = whole("ways", ways, 1) or 1
    preparation = plan.preparation or prepared(plan.site, told)[1]
    job = job_of(plan.record.plan, preparation, plan.motions, begin - 1, most, ways)
    if tracks is None:
        return job
    return replace(job, ground=with_tracks(job.ground, read_tracks(path_of("live_job", tracks, "a track file"))))
