"""The input of a page: revisions of a plan with their motions and proofs, as values."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import asdict, dataclass, field
from enum import StrEnum

from bimvox.motion.steps import steps_of_log
from bimvox.records.dates import dates_of
from bimvox.records.lift import Lift, LiftPlan, infeasible_among
from bimvox.records.motion import LiftMotion
from bimvox.records.plan_dates import PlanDates
from bimvox.records.proof import Remark, Severity, Verification, are_clean, in_words
from bimvox.records.props import Props, Standing
from bimvox.records.steps import Steps, by_other_means, proven_in_words
from bimvox.records.track import LoadTrack
from bimvox.remarks.conditions import conditions_of
from bimvox.remarks.not_covered import NotCovered, not_covered_by
from bimvox.remarks.proven_props import proven_props
from bimvox.rendering.words import counted
from bimvox.site.config.calendar import CalendarConfig
from bimvox.site.config.site_config import SiteConfig


class Light(StrEnum):
    """The colour of a verdict; also the name of its style."""

    CLEAN = "clean"
    """Green: proven without reservation, and no remark but notes."""
    REMARKED = "remarked"
    """Amber: proven, with minor remarks or with a reservation."""
    SERIOUS = "serious"
    """Strong amber: proven, but a person must decide about a remark first."""
    REFUSED = "refused"
    """Red: not proven."""
    PLAIN = "plain"
    """No colour: no remark, next to a plan that is not proven."""


_SIGNS = {Light.CLEAN: "✓ ", Light.REMARKED: "! ", Light.SERIOUS: "⚠\ufe0e ", Light.REFUSED: "✕ ", Light.PLAIN: ""}


@dataclass(frozen=True, slots=True)
class Verdict:
    """The verdict in words.

    Attributes:
        proof: Whether it is proven, or which check failed.
        proof_light: The colour of ``proof``.
        remarks: How many remarks there are, and how many of them are serious.
        remarks_light: The colour of ``remarks``.
    """

    proof: str
    proof_light: Light
    remarks: str
    remarks_light: Light

    @property
    def line(self) -> str:
        """Both as one line of text."""
        return f"{self.proof}; {self.remarks}"

    def to_dict(self) -> dict[str, str]:
        """Return the verdict as plain values."""
        return {key: str(value) for key, value in asdict(self).items()}


def verdict_of(
    proof: Verification | None, remarks: Collection[Remark], *, carried: int, lifts: Collection[Lift]
) -> Verdict:
    """Return the verdict about a plan.

    ``carried``: number of lifts that the log carries; ``lifts``: all of the plan. The proof is None if none was
    made.
    """
    verified = proof is not None and proof.verified
    found = _light_of(remarks)
    remarks_light = found if found in (Light.REMARKED, Light.SERIOUS) or verified else Light.PLAIN
    said = in_words(remarks)
    sign = "" if found is Light.CLEAN else _SIGNS[remarks_light]
    if proof is None or not verified:
        return Verdict(f"{_SIGNS[Light.REFUSED]}{_refusal(proof)}", Light.REFUSED, sign + said, remarks_light)
    others = len(by_other_means(lifts))
    light = Light.REMARKED if found is Light.CLEAN and (proof.not_current or others) else found
    words = proven_in_words(others, len(proof.claims))
    if carried < len(lifts):
        words += f" ({carried:,} of {counted(len(lifts), 'lift')})"
    if proof.not_current:
        words += f", {counted(len(proof.not_current), 'lift')} against earlier obstructions only"
    tick = _SIGNS[light] if light is Light.CLEAN else ""
    return Verdict(tick + words, light, sign + said, remarks_light)


def _light_of(remarks: Collection[Remark]) -> Light:
    if any(remark.severity is Severity.SERIOUS for remark in remarks):
        return Light.SERIOUS
    return Light.CLEAN if are_clean(remarks) else Light.REMARKED


def _refusal(proof: Verification | None) -> str:
    if proof is None:
        return "NOT PROVEN: no proof was made"
    first, *others = (check.name.replace("_", " ") for check in proof.checks if not check.passed)
    more = f" and {counted(len(others), 'more check')}" if others else ""
    return f"NOT PROVEN: {first}{more}"


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
        times: The dates, or the times by numbered working days if the start is not known; None of an extract, or
            without a crane.
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
    times: PlanDates | None = field(init=False)

    @property
    def props(self) -> Props:
        """What holds the lifted parts when they are released."""
        return proven_props(self.plan, tuple(self.motions), tuple(self.context))

    @property
    def props_standing(self) -> tuple[Standing, ...]:
        """The parts that have props, and when these stand on the site's clock."""
        return self.props.standing(self.steps, max((motion.end_ns for motion in self.motions), default=0))

    def __post_init__(self) -> None:
        object.__setattr__(self, "steps", steps_of_log(self.plan, self.motions, self.context))
        calendar = self.config.calendar if self.config else CalendarConfig()
        known = self.dates
        if known is None and not self.context and all(motion.is_phased for motion in self.motions):
            known = dates_of(calendar, self.plan.site, self.plan.lifts, self.motions, self.steps, numbered=True)
        object.__setattr__(self, "times", known)

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
    def not_covered(self) -> tuple[NotCovered, ...]:
        """What the plan does not cover, each a line that a person ticks."""
        return not_covered_by(self.plan, self.context)

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
