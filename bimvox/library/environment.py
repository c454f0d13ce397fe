"""The lifts of a site or a plan as problems of the environments ``bimvox/Lift-v0`` and ``bimvox/LiveSite-v0``."""

from __future__ import annotations

from dataclasses import replace
from os import PathLike
from pathlib import Path

from bimvox.env.problem import LiftProblem, is_learnable
from bimvox.errors import NoPlanError
from bimvox.library.arguments import insist, path_of, whole
from bimvox.library.hand_over import may_go_to_others
from bimvox.library.plan_value import Plan
from bimvox.library.prove import prepared
from bimvox.library.site import LoadedSite, load_site
from bimvox.live.episode import LiveJob
from bimvox.live.planned import job_of
from bimvox.live.tracks import read_tracks, with_tracks
from bimvox.planning.preparation import preparation_in
from bimvox.policy.site_lessons import training_problems
from bimvox.progress import Listener, progress_of


def lift_problems(
    site: LoadedSite | Plan | Path | str, *, seed: int = 0, progress: Listener = None
) -> tuple[LiftProblem, ...]:
    """Return lifts of a site to learn from, at most 20, spread evenly over its assembly.

    Each has the parts before it in place, starts all over the yard, and the target above its place. They are what
    ``bimvox train`` learns from, and what the environment takes: ``gymnasium.make("bimvox/Lift-v0", problems=...)``.

    Args:
        site: A site, the path of a site file, or a plan: its site with its obstructions.
        seed: Chooses the starts, from 0.
        progress: A ``Progress``, or a function that takes a line of text.

    Raises:
        InputError: If an argument is of another kind, or the seed is out of range.
        NoPlanError: If no part can be lifted.
    """
    insist("lift_problems", site, (LoadedSite, Plan, str, PathLike), "site, a plan or the path of a site file")
    reporter, number = progress_of(progress), whole("seed", seed, 0) or 0
    if not isinstance(site, LoadedSite | Plan):
        site = load_site(path_of("lift_problems", site, "a site file"), reporter)
    if isinstance(site, Plan):
        built, preparation = site.site, site.preparation or preparation_in(site.record.whole_plan)
    else:
        built, preparation = prepared(site.site, reporter, free=may_go_to_others(site))
    found = training_problems(built, preparation, number, reporter, with_obstructions=True)
    reporter.finish()
    learnable = tuple(problem for problem in found if is_learnable(problem))
    if not learnable:
        raise NoPlanError("no part of the site can be lifted", hint="plan(site) says why, part by part")
    return learnable


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
    reporter, begin, most = progress_of(progress), whole("first", first, 1) or 1, whole("count", count, 1) or 1
    ways = whole("ways", ways, 1) or 1
    preparation = plan.preparation or prepared(plan.site, reporter)[1]
    job = job_of(plan.record.plan, preparation, plan.motions, begin - 1, most, ways)
    if tracks is None:
        return job
    return replace(job, ground=with_tracks(job.ground, read_tracks(path_of("live_job", tracks, "a track file"))))
