"""The input of a page: revisions of a plan with their motions and proofs, as values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from bimvox.motion.steps import steps_of_log
from bimvox.records.dates import PlanDates
from bimvox.records.lift import Lift, LiftPlan, infeasible_among
from bimvox.records.motion import LiftMotion
from bimvox.records.proof import Remark, Verification
from bimvox.records.steps import Steps
from bimvox.records.track import LoadTrack
from bimvox.remarks.conditions import conditions_of
from bimvox.rendering.verdict import Verdict, verdict_of
from bimvox.site.config.site_config import SiteConfig


@dataclass(frozen=True, slots=True, eq=False)
class Revision:
    """One plan of a site.

    Attributes:
        number: Its revision number.
        log: Name of its log file, without folder.
        sha256: SHA-256 of that file.
        plan: Site and lifts that the log carries.
        context: Lifts of the same plan that the log, an extract, does not carry.
        motions: Motions of the planned lifts, in order; none without a crane.
        tracks: Tracks of their loads, in order.
        proof: The verdict of a proof made now from the log; None if none was made.
        remarks: What a person should look at.
        metadata: Plain values about the plan (seed, policy, hashes ...).
        dates: The plan in calendar time; None if its start is not known.
        config: The site file that the log carries; None if it carries none that can be read.
        steps: The steps of work that the crane does not do, and its pauses.
    """

    number: int
    log: str
    sha256: str
    plan: LiftPlan
    context: tuple[Lift, ...]
    motions: tuple[LiftMotion, ...]
    tracks: tuple[LoadTrack, ...]
    proof: Verification | None
    remarks: tuple[Remark, ...]
    metadata: Mapping[str, str] = field(default_factory=dict)
    dates: PlanDates | None = None
    config: SiteConfig | None = None
    steps: Steps = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "steps", steps_of_log(self.plan, self.motions, self.context))

    @property
    def lifts(self) -> tuple[Lift, ...]:
        """All lifts, carried or not, in ascending order."""
        return self.plan.lifts_with(self.context)

    @property
    def infeasible(self) -> int:
        """How many lifts are infeasible."""
        return len(infeasible_among(self.lifts))

    @property
    def conditions(self) -> tuple[str, ...]:
        """What the proof took as given."""
        return conditions_of(self.plan, self.motions, self.context)

    @property
    def verdict(self) -> Verdict:
        """What is proven, and the remarks next to it, in words."""
        return verdict_of(self.proof, self.remarks, carried=len(self.plan.lifts), lifts=self.lifts)


@dataclass(frozen=True, slots=True, eq=False)
class PageSource:
    """What a page shows.

    Attributes:
        revisions: Plans of one site that differ by obstructions only, ascending; the last one is shown first.
        left_out: Number of earlier revisions that the page leaves out.
    """

    revisions: tuple[Revision, ...]
    left_out: int = 0
