"""What is prepared for a site; for several cranes with a faster erection sequence, by their scheduled motions.

The local search estimates. So its sequences, with each part lifted by its crane and with other cranes where that may be
faster, are planned and scheduled without obstructions, the greedy one included. Kept is the one in which fewest lifts
have no free time, and of these the fastest.
"""

from __future__ import annotations

from collections.abc import Collection

from bimvox.cranes.lift import NoFreeTimeError
from bimvox.cranes.schedule import time_lifts
from bimvox.errors import MotionError
from bimvox.library.hand_over import given_to_others, handed_over
from bimvox.planning.order_search import faster, plan_without_obstructions, prepare
from bimvox.planning.planner import plan_lifts
from bimvox.planning.preparation import Preparation
from bimvox.progress import Report
from bimvox.site.site import Site
from bimvox.walk import Store
from bimvox.workers import ALONE, Workers


def preparation_of(
    site: Site,
    progress: Report | None = None,
    workers: Workers = ALONE,
    free: Collection[str] = (),
    store: Store | None = None,
) -> tuple[Site, Preparation]:
    """Return contacts, order and yard places of a site, and the site with the crane that lifts each part.

    Args:
        site: The site.
        progress: Called with (stage, done, total).
        workers: Share the work.
        free: Ids of the components that another crane may lift.
        store: What was planned and timed before is not done again.
    """
    store = Store() if store is None else store
    preparation = prepare(site, progress, workers, store)
    if not site.has_several_cranes:
        return site, preparation
    return faster_on_the_clock(site, preparation, workers, free, store)


def faster_on_the_clock(
    site: Site,
    greedy: Preparation,
    workers: Workers = ALONE,
    free: Collection[str] = (),
    store: Store | None = None,
) -> tuple[Site, Preparation]:
    """Return the preparation of a site with several cranes with the fastest sequence that is found, and the site then.

    Args:
        site: The site.
        greedy: Its preparation with the greedy sequence.
        workers: Share the work.
        free: Ids of the components that another crane may lift.
        store: As for ``preparation_of``.
    """
    store = Store() if store is None else store
    ways = [(site, greedy)]
    for ids in ((), free):
        found = faster(site, greedy, workers, ids, store) if ids is free or free else None
        if found is not None and all(_differs(found, way) for way in ways):
            ways.append(found)
    if len(ways) == 1:
        return ways[0]
    ends = [waiting_and_end(*way, workers, free, store) for way in ways]
    known = [n for n, end in enumerate(ends) if end is not None]
    other, made = ways[min(known, key=lambda n: ends[n] or (0, 0), default=0)]
    return given_to_others(site, other, made)


def _differs(one: tuple[Site, Preparation], other: tuple[Site, Preparation]) -> bool:
    cranes, others = ([part.crane for part in site.components] for site, _ in (one, other))
    return cranes != others or one[1].sequence.order != other[1].sequence.order


def waiting_and_end(
    site: Site,
    preparation: Preparation,
    workers: Workers = ALONE,
    free: Collection[str] = (),
    store: Store | None = None,
) -> tuple[int, int] | None:
    """Return how many lifts have no free time, and when the last one ends; None if a lift cannot be driven.

    The end is on the site's clock without obstructions.

    Args:
        site: The site, with several cranes.
        preparation: Its preparation.
        workers: Share the work.
        free: Ids of the components that another crane may lift if their own has no free time for them.
        store: As for ``preparation_of``.
    """
    store = Store() if store is None else store
    plan = plan_without_obstructions(site, preparation, workers, store)
    site, handed, refused = plan.site, set[str](), dict[str, str]()
    while True:
        try:
            motions = time_lifts(plan, preparation, store, workers)
        except NoFreeTimeError as error:
            may = [part for part in error.reasons if part in free and part not in handed]
            handed.update(may)
            site, preparation, given_away = handed_over(site, preparation, may)
            refused.update({part: why for part, why in error.reasons.items() if part not in given_away})
            plan = plan_lifts(site, preparation, refused=refused, workers=workers, store=store)
        except MotionError:
            return None
        else:
            return len(refused), max((motion.end_ns for motion in motions), default=0)
