"""When parts are at their places, carry, and hang above the site: elapsed times that the places of props depend on."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from bimvox.records.lift import Lift
from bimvox.records.motion import LiftMotion
from bimvox.records.steps import Steps, cured_ns
from bimvox.site.site import Site

NEVER_NS = 2**62
"""Later than everything."""


@dataclass(frozen=True, slots=True)
class Timeline:
    """Elapsed times of components, by index.

    Attributes:
        there_ns: When each is at its place, or work at it begins; ``NEVER_NS`` if it is not set.
        carries_ns: When its joints or its concrete carry.
        in_air_ns: From when and until when it hangs above the site, of those that are lifted.
    """

    there_ns: tuple[int, ...]
    carries_ns: tuple[int, ...]
    in_air_ns: Mapping[int, tuple[int, int]]


def timeline(site: Site, lifts: Iterable[Lift], motions: Mapping[int, LiftMotion], steps: Steps) -> Timeline:
    """Return the times of a plan.

    ``motions``: by order of their lifts; ``steps``: other work, and the pauses.
    """
    there = [NEVER_NS] * len(site.components)
    carries, in_air, work = there.copy(), dict[int, tuple[int, int]](), steps.of_order
    for lift in lifts:
        n, motion, step = lift.component, motions.get(lift.order), work.get(lift.order)
        if motion is not None:
            there[n] = steps.ending_ns(motion.set_ns)
            carries[n] = cured_ns(site, steps, motion) or steps.ending_ns(motion.released_ns)
            in_air[n] = (steps.starting_ns(motion.raised_ns), there[n])
        elif step is not None:
            there[n], carries[n] = step.begins_ns, step.carries_ns
    return Timeline(tuple(there), tuple(carries), in_air)
