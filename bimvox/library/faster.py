"""What is prepared for a site; for several cranes with a faster erection sequence, by their scheduled motions.

The estimate of the local search leaves out that cranes keep apart. So both sequences are planned and scheduled without
obstructions, and the faster one is kept; a sequence in which a lift finds no free time is not.
"""

from __future__ import annotations

from bimvox.cranes.schedule import time_lifts
from bimvox.errors import MotionError
from bimvox.planning.assembly import Preparation, faster, prepare, without_obstructions
from bimvox.planning.planner import plan_lifts
from bimvox.progress import Report
from bimvox.site.site import Site
from bimvox.workers import ALONE, Workers


def preparation_of(site: Site, progress: Report | None = None, workers: Workers = ALONE) -> Preparation:
    """Return contacts, order and yard places of a site, with the work shared between processes."""
    preparation = prepare(site, progress, workers)
    return faster_on_the_clock(site, preparation, workers) if site.has_several_cranes else preparation


def faster_on_the_clock(site: Site, greedy: Preparation, workers: Workers = ALONE) -> Preparation:
    """Return the preparation of a site with several cranes with a faster sequence; the given one if none is found."""
    found = faster(site, greedy, workers)
    if found is None:
        return greedy
    clear = without_obstructions(site)
    ends_ns = [_end_ns(clear, one, workers) for one in (greedy, found)]
    return found if ends_ns[1] is not None and (ends_ns[0] is None or ends_ns[1] < ends_ns[0]) else greedy


def _end_ns(site: Site, preparation: Preparation, workers: Workers) -> int | None:
    """Return when the last lift ends, on the site's clock; None if a lift cannot be driven."""
    plan = plan_lifts(site, preparation, workers=workers)
    try:
        motions = time_lifts(plan, preparation, workers=workers)
    except MotionError:
        return None
    return max((motion.end_ns for motion in motions), default=0)
