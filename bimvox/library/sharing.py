"""The processes that share the work of planning one site."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from bimvox.motion.time_plan import time_plan
from bimvox.planning.planner import plan_lifts
from bimvox.planning.preparation import Preparation
from bimvox.processes import processors
from bimvox.proof.motion import verify_motions
from bimvox.proof.plan import verify_plan
from bimvox.site.site import Site
from bimvox.workers import ALONE, Workers

_FEW_PARTS, _FEW_SHARED = 100, 50
"""So few are planned before a worker has started, by one crane or by several, whose legs and distances take longer."""


@contextmanager
def workers_of(site: Site, jobs: int | None) -> Iterator[Workers]:
    """Start the processes that share the work on a site, and end them after the block.

    Args:
        site: The site.
        jobs: Number of processes, this one included; None: one per processor.
    """
    wanted = processors() if jobs is None else jobs
    few = _FEW_SHARED if site.has_several_cranes else _FEW_PARTS
    if wanted == 1 or len(site.components) < few:
        yield ALONE
        return
    workers = Workers(wanted, (plan_lifts, verify_plan, time_plan, verify_motions))
    try:
        yield workers
    finally:
        workers.close()


def constants_of(site: Site, preparation: Preparation | None = None) -> list[object]:
    """Return what does not change while a site is planned, proven or revised: what is sent to a worker once."""
    prepared = [] if preparation is None else [*filter(None, preparation.places), preparation]
    return [*site.components, *site.blockers, site.frame, *prepared, site]
