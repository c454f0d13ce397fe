"""The score of an order on ``Sequence-v0``: each building is planned, timed and proven by the engine."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Annotated, Literal

from pydantic import Field

from bimvox.errors import BimvoxError
from bimvox.library.plan import plan
from bimvox.library.sequences.baselines import Baseline
from bimvox.library.sequences.suite import SequenceProblem, digest_of, frozen_site
from bimvox.planning.all_orders import least_makespan_s
from bimvox.progress import Progress
from bimvox.site.config.validation import Table, Text, Whole
from bimvox.version import __version__

_Count = Annotated[Whole, Field(ge=0)]
_Seconds = Annotated[float, Field(ge=0.0)]


class BuildingScore(Table):
    """How an order did on one building."""

    problem: Text
    """Its name."""
    digest: Text
    """Of all that decides it."""
    lifts: _Count
    """Parts that the crane lifts."""
    proven: _Count
    """Those whose lifts are planned and proven."""
    makespan_s: _Seconds | None
    """From the start of the first lift to the end of the last, as proven; null unless all lifts are proven."""
    least_s: _Seconds
    """No order, yard and assignment takes less."""
    ratio: _Seconds | None
    """``makespan_s`` / ``least_s``."""
    seconds: _Seconds
    """Time to find the order, to plan and to prove; depends on the machine."""
    reason: Text | None
    """Why there is no plan, if there is none."""


class SequenceScore(Table):
    """The score of an order on the frozen buildings."""

    order: Text
    """A baseline, or ``module:function``."""
    format: Literal["bimvox-sequence-score"]
    """Name of this format."""
    version: Literal[1]
    """Version of this format."""
    bimvox: Text
    """Version of bimvox."""
    buildings: tuple[BuildingScore, ...]
    """The score of each."""
    solved: _Count
    """Buildings of which every lift is proven."""
    ratio: _Seconds | None
    """Mean of ``ratio`` over these."""


def score(order: str, baseline: Baseline, problems: Sequence[SequenceProblem], progress: Progress) -> SequenceScore:
    """Return the score of an order.

    Args:
        order: What names it in the result.
        baseline: What makes it; buildings that are not for it are left out.
        problems: The buildings.
        progress: Counts them.

    Raises:
        InputError: A building is not the frozen one.
    """
    found = []
    with progress.stage(f"scoring {order}", len(problems)):
        for problem in problems:
            if (one := _of(baseline, problem)) is not None:
                found.append(one)
            progress.advance()
    ratios = [one.ratio for one in found if one.ratio is not None]
    return SequenceScore(
        order=order,
        format="bimvox-sequence-score",
        version=1,
        bimvox=__version__,
        buildings=tuple(found),
        solved=len(ratios),
        ratio=round(sum(ratios) / len(ratios), 4) if ratios else None,
    )


def _of(baseline: Baseline, problem: SequenceProblem) -> BuildingScore | None:
    site = frozen_site(problem)
    lifts = sum(part.means.value == "crane" for part in site.components)
    least_s, began = least_makespan_s(site.site), time.perf_counter()
    proven, makespan_s, reason = 0, None, None
    try:
        chosen = baseline(site)
        if chosen is None:
            return None
        made = plan(chosen[0], order=chosen[1])
        proven = sum(lift.is_planned for lift in made.lifts) if made.verified else 0
        if proven == lifts:
            makespan_s = round(max(motion.end_ns for motion in made.motions) / 1e9, 3)
        else:
            reason = next((f"{lift.name}: {lift.reason}" for lift in made.infeasible), None)
    except BimvoxError as error:
        reason = error.message
    return BuildingScore(
        problem=problem.name,
        digest=digest_of(site),
        lifts=lifts,
        proven=proven,
        makespan_s=makespan_s,
        least_s=round(least_s, 3),
        ratio=None if makespan_s is None else round(makespan_s / least_s, 4),
        seconds=round(time.perf_counter() - began, 2),
        reason=reason,
    )
