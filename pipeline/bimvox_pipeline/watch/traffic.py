"""``bimvox watch --simulate --traffic``: a plan carried out among people and vehicles."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from bimvox.errors import InputError
from bimvox.files import check_output
from bimvox.library.plan_value import write_log_file
from bimvox.library.revise import carry_out as carry_out_plan
from bimvox.live.execution import Execution
from bimvox.live.tracks import NamedTraffic, traffic_named
from bimvox.log.plan_log import PlanLog
from bimvox.planning.preparation import Preparation
from bimvox.progress import Progress
from bimvox.records.lift import Status
from bimvox.site.site import Site
from bimvox_pipeline.watch.plan import WatchWish
from bimvox_pipeline.watch.simulate import PlanClock, changes_of, state_document

_LOOK_S = 0.1


def traffic_of(how: WatchWish) -> NamedTraffic:
    """Return the traffic that a watch asks for.

    Raises:
        InputError: If it is neither a seed nor a file, or does not fit the other options.
        FileError: If the tracks cannot be used; names the line or the key.
    """
    text = how.traffic or ""
    if how.speed is None:
        raise InputError("--traffic needs --simulate", hint=f"for example --simulate 1000 --traffic {text}")
    for option, is_given in (("--retrain", how.retrain), ("--serve", how.serve)):
        if is_given:
            raise InputError(f"--traffic does not go with {option}", hint=f"leave {option} out")
    return traffic_named(text)


def insist_on_one_crane(site: Site) -> None:
    """Raise an error if a site has several cranes or none."""
    if site.moving is not None:
        raise InputError(
            "--traffic: the crane of the site moves; a plan is carried out in traffic with one that stays where it is",
            hint="leave --traffic out",
        )
    if len(site.cranes) != 1:
        raise InputError(
            f"--traffic: the site has {len(site.cranes)} cranes; a plan is carried out in traffic with exactly one",
            hint="leave --traffic out",
        )


def carry_out(
    record: PlanLog, preparation: Preparation, wished: NamedTraffic, speed: float, target: Path, progress: Progress
) -> Iterator[dict[str, Any]]:
    """Carry a plan out in traffic, write its log, and yield what happens at the times at which it happens.

    Args:
        record: The plan.
        preparation: What it was made from.
        wished: The traffic.
        speed: Seconds on the site's clock per second on the wall clock.
        target: The log of the plan; the log of the execution is next to it.
        progress: Receives the stages.

    Yields:
        A document for every change of a part's state, then one with the whole.
    """
    path = target.with_name(f"{target.stem}.traffic{target.suffix}")
    check_output(path, inputs=[target, *([] if wished.file is None else [wished.file])])
    log, done, verdict = carry_out_plan(record, preparation, wished.traffic, wished.source, wished.file, progress)
    write_log_file(path, log)
    clock = PlanClock(speed)
    clock.start()
    for at_ns, document in _states(log, done):
        while (left_ns := at_ns - clock.now_ns) > 0:
            time.sleep(min(_LOOK_S, left_ns / 1e9 / speed))
        yield document | {"revision": log.revision, "log": str(path)}
    assert log.carried_out is not None
    tally = log.carried_out.tally
    lifts = sum(lift.status is Status.PLANNED for lift in log.plan.lifts)
    yield {
        "event": "traffic",
        "revision": log.revision,
        "log": str(path),
        "traffic": wished.source,
        "decider": log.carried_out.decider,
        "lifts": lifts,
        "delivered": tally.delivered,
        "time_s": round(int(done.time_ns[-1]) / 1e9, 3),
        "time_lost_s": round(tally.lost_s, 3),
        "moved": done.moved,
        "stops": tally.stops,
        "waits": tally.waits,
        "others_waited_s": round(done.held_s, 1),
        "least_distance_m": tally.least_m,
        "violations": tally.violations,
        "verified": verdict.verified,
        "failures": list(verdict.failures),
    }


def _states(log: PlanLog, done: Execution) -> list[tuple[int, dict[str, Any]]]:
    """Return when parts changed their state, as carried out."""
    components, found = log.plan.site.components, []
    for motion in log.motions:
        for plan_ns, state in changes_of(motion):
            if plan_ns <= done.plan_ns[-1]:
                row = int(np.searchsorted(done.plan_ns, plan_ns, side="right"))  # after a wait at that time
                at_ns = int(done.time_ns[min(row, len(done.time_ns) - 1)])
                found.append((at_ns, state_document(components[motion.component].id, motion, state, at_ns)))
    return sorted(found, key=lambda one: one[0])
