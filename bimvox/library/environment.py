"""The lifts of a site of one's own as problems of the environment ``bimvox/Lift-v0``."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

from bimvox.env.problem import LiftProblem, is_learnable
from bimvox.errors import NoPlanError
from bimvox.library.arguments import insist, path_of, whole
from bimvox.library.hand_over import may_go_to_others
from bimvox.library.plan_value import Plan
from bimvox.library.prove import prepared
from bimvox.library.site import LoadedSite, load_site
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
    told, number = progress_of(progress), whole("seed", seed, 0) or 0
    if not isinstance(site, LoadedSite | Plan):
        site = load_site(path_of("lift_problems", site, "a site file"), told)
    if isinstance(site, Plan):
        built, preparation = site.site, site.preparation or preparation_in(site.record.whole_plan)
    else:
        built, preparation = prepared(site.site, told, free=may_go_to_others(site))
    found = training_problems(built, preparation, number, told, as_it_is=True)
    told.finish()
    learnable = tuple(problem for problem in found if is_learnable(problem))
    if not learnable:
        raise NoPlanError("no part of the site can be lifted", hint="plan(site) says why, part by part")
    return learnable
