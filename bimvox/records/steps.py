"""The steps of work that the crane does not do, and the pauses of the crane until such work carries.

The site's clock counts crane time: it stands during a pause. Elapsed time counts the pauses too. Both begin with the
first lift; work before it has negative times.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import accumulate
from typing import Any

from bimvox.records.motion import LiftMotion
from bimvox.site.casting import curing_s
from bimvox.site.site import Site
from bimvox.units import NS_PER_S


@dataclass(frozen=True, slots=True)
class Step:
    """Work at a part that the crane does not set, in elapsed time.

    Attributes:
        order: Position in the erection sequence.
        component: Index into ``Site.components``.
        begins_ns: When the work begins: after all earlier lifts of the sequence.
        ends_ns: When the work ends.
        carries_ns: When it carries what rests on it.
    """

    order: int
    component: int
    begins_ns: int
    ends_ns: int
    carries_ns: int

    def seconds(self) -> dict[str, float]:
        """Return its times in seconds, for documents."""
        return {f"{key}_s": round(getattr(self, f"{key}_ns") / 1e9, 3) for key in ("begins", "ends", "carries")}


@dataclass(frozen=True, slots=True)
class Pause:
    """A pause of the crane before a lift, until what the part rests on carries.

    Attributes:
        order: The lift's position in the erection sequence.
        at_ns: When it is, on the site's clock.
        length_ns: How long it is.
    """

    order: int
    at_ns: int
    length_ns: int


@dataclass(frozen=True, slots=True)
class Steps:
    """All steps and pauses of a plan, each in ascending order.

    Attributes:
        steps: The steps.
        pauses: The pauses.
    """

    steps: tuple[Step, ...] = ()
    pauses: tuple[Pause, ...] = ()

    def starting_ns(self, at_ns: int) -> int:
        """Return the elapsed time of something that starts at a time on the site's clock: after a pause then."""
        return at_ns + self._paused_ns(bisect_right([pause.at_ns for pause in self.pauses], at_ns))

    def ending_ns(self, at_ns: int) -> int:
        """Return the elapsed time of something that ends at a time on the site's clock: before a pause then."""
        return at_ns + self._paused_ns(bisect_left([pause.at_ns for pause in self.pauses], at_ns))

    def documents(self, site: Site) -> dict[str, list[dict[str, Any]]]:
        """Return ``steps`` and ``pauses`` for the JSON documents; times in seconds."""
        parts = site.components
        return {
            "steps": [
                {
                    "number": step.order + 1,
                    "component": parts[step.component].id,
                    "name": parts[step.component].name,
                    "means": parts[step.component].means.value,
                }
                | step.seconds()
                for step in self.steps
            ],
            "pauses": [
                {
                    "number": pause.order + 1,
                    "at_s": round(pause.at_ns / 1e9, 3),
                    "length_s": round(pause.length_ns / 1e9, 3),
                }
                for pause in self.pauses
            ],
        }

    def elapsed_ns(self, motions: Iterable[LiftMotion]) -> int:
        """Return the elapsed time from the first lift to the end of the last work, lift or other."""
        lifts_ns = (self.ending_ns(motion.end_ns) for motion in motions)
        return max([0, *lifts_ns, *(step.ends_ns for step in self.steps)])

    @property
    def paused_ns(self) -> int:
        """How long the crane pauses, all pauses together."""
        return self._paused_ns(len(self.pauses))

    @property
    def of_order(self) -> dict[int, Step]:
        """The steps by order."""
        return {step.order: step for step in self.steps}

    def _paused_ns(self, count: int) -> int:
        return list(accumulate((pause.length_ns for pause in self.pauses[:count]), initial=0))[-1]


def cured_ns(site: Site, steps: Steps, motion: LiftMotion) -> int | None:
    """Return the elapsed time from which the joints of a lifted part carry what rests on it; None: from its release.

    Args:
        site: The site.
        steps: All pauses before the release.
        motion: The motion of the part.
    """
    cures_s = curing_s(site.rules.curing, site.components[motion.component])
    return steps.ending_ns(motion.released_ns) + round(cures_s * NS_PER_S) if cures_s else None
