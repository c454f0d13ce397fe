"""Compares an execution with what its log states about it: the seed or the tracks of those who moved."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np
from numpy.typing import NDArray

from bimvox.errors import FileError
from bimvox.library.compare import same, same_values
from bimvox.live.again import carried_out_again
from bimvox.live.deciders import Rules
from bimvox.live.named_traffic import NamedTraffic, traffic_stated
from bimvox.log.plan_log import PlanLog
from bimvox.records.motion import CarriedOut
from bimvox.records.proof import Check

DECIDER = "a rule chooses the next lift and when to wait"
DECIDES = Rules()
"""Who decides in every execution of a log, and what it is called there."""
_SAME = 1e-6


def check_traffic(log: PlanLog, found: CarriedOut) -> Check:
    """Check an execution, tick by tick, with what the simulation gives for what the log states.

    Who moves follows from the seed, or from the attached tracks; where they go and are seen, and when the crane waits,
    from the plan, which is in the order carried out. This is the simulation of ``watch``, not a proof of its own.

    Args:
        log: The log; its plan and its execution are proven.
        found: Its execution.
    """
    check = Check("traffic", unit="m")
    same(check, "who decided", found.decider, DECIDER, "every execution of bimvox")
    try:
        traffic = traffic_stated(found.source, log.attachments)
    except (ValueError, FileError) as error:
        check.look(False, f"the traffic of the execution: {error}")
        return check
    ticks = len(found.time_ns) - 1
    again = carried_out_again(log.plan, log.motions, traffic, DECIDES, ticks)
    if [*found.others] != [*again.others]:
        there, wanted = (
            ", ".join(f"{one.id} ({one.kind})" for one in those) or "nobody" for those in (found.others, again.others)
        )
        check.look(False, f"in the log there move {there}; in the stated traffic ({found.source}) {wanted}")
        return check
    for n, other in enumerate(found.others):
        for what, name in (("is", "place_m"), ("is seen", "seen_m")):
            off_m = _off(getattr(found, name)[:, n], getattr(again, name)[:, n])
            _look(
                check, off_m, f"{other.id} {what} {{off:.2f}} m from where the stated traffic ({found.source}) has it"
            )
            check.measure(float(off_m.max()))
    off_s = _off((found.plan_ns / 1e9)[:, None], (again.plan_ns / 1e9)[:, None])
    _look(check, off_s, "the crane is {off:.1f} s from where it is on the plan's clock among them")
    off = _off(found.pace[:, None], again.pace[:, None])
    _look(check, off, "the crane's pace is {off:.2g} from what it is among them")
    check.look(len(again.time_ns) == ticks + 1, "the execution goes on after its end, or ends before it")
    return check


def compare_traffic(check: Check, log: PlanLog, given: NamedTraffic) -> None:
    """Check that the execution of a log is among the given traffic: the same seed, or the same tracks."""
    if log.carried_out is None:
        check.look(False, "the log holds no execution among people and vehicles")
    elif given.file is None:
        same(check, "the traffic", log.carried_out.source, given.source, "your wish")
    else:
        try:
            tracks = traffic_stated(log.carried_out.source, log.attachments).tracks
        except (ValueError, FileError) as error:
            check.look(False, f"the traffic of the execution: {error}")
            return
        own, yours = ({one.name: asdict(one) for one in those} for those in (tracks, given.traffic.tracks))
        same(check, "the tracks", [*own], [*yours], "your file")
        same_values(check, "tracks", own, yours, "your file")


def _off(found: NDArray[np.float64], wanted: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (N,) how far two ways are apart at each of the samples that both have."""
    count = min(len(found), len(wanted))
    return np.asarray(np.linalg.norm(found[:count] - wanted[:count], axis=1), np.float64)


def _look(check: Check, off: NDArray[np.float64], told: str) -> None:
    wrong = np.flatnonzero(off > _SAME)
    first = int(wrong[0]) if len(wrong) else 0
    check.look(not len(wrong), f"at {first / 2:.1f} s {told.format(off=off[first])}", samples=len(off))
