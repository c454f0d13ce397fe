"""Of what the plan of a site is, as one value that every view of the studio shows.

There are four states: no plan, a plan of exactly these files, a plan of an earlier state, a plan that is being made or
revised. They follow from hashes: the log carries the site file, the hash of the model and the obstructions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from datetime import datetime
from enum import StrEnum
from typing import Any

from bimvox.rendering.words import counted


class PlanIs(StrEnum):
    """The four states."""

    NONE = "none"
    CURRENT = "current"
    EARLIER = "earlier"
    WORKING = "working"


_TITLES = {
    PlanIs.NONE: "No plan",
    PlanIs.CURRENT: "Plan of exactly these files",
    PlanIs.EARLIER: "Plan of an earlier state",
    PlanIs.WORKING: "Plan being made",
}
_REVISED = "Plan being revised"


@dataclass(frozen=True, slots=True)
class Counts:
    """How many lifts of a plan have which outcome; every view counts by these.

    Attributes:
        planned: Those with a path.
        refused: Those for which there is none.
        replanned: Those of the planned whose path is new in the newest revision.
        done: Those of the planned that have been carried out.
        waiting: Those that still wait for a path while a watch revises the plan.
        revision: Number of the newest revision.
    """

    planned: int
    refused: int
    replanned: int
    done: int
    waiting: int
    revision: int

    @property
    def words(self) -> str:
        """All of them; what is none of a watch is left out."""
        more = f", {self.replanned:,} replanned in revision {self.revision}" if self.replanned else ""
        more += f", {self.waiting:,} without a path yet" if self.waiting else ""
        more += f", {self.done:,} done" if self.done else ""
        return f"{counted(self.planned, 'lift')} planned, {self.refused:,} refused{more}"


@dataclass(frozen=True, slots=True)
class Job:
    """A plan or a watch under way.

    Attributes:
        since: When it began.
        makes: Whether it makes a first plan; otherwise it keeps a plan up to date with the obstructions.
        is_pending: Of a watch, whether lifts still wait for a new path.
        is_stuck: Of a watch, whether it could not use the newest obstructions, so that the last good plan stays.
        changes: What differs now from what it began with.
    """

    since: datetime
    makes: bool
    is_pending: bool = False
    is_stuck: bool = False
    changes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Planned:
    """A plan on disk.

    Attributes:
        since: When it was written.
        counts: Its lifts.
        obstructions: The obstructions that have changed since.
        changes: What else has changed since.
    """

    since: datetime
    counts: Counts
    obstructions: tuple[str, ...] = ()
    changes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class PlanState:
    """The state of a site's plan.

    Attributes:
        state: Which of the four.
        title: The state in a few words.
        words: The state, its lifts and what has changed, in a sentence or two.
        since: When the plan was written, or its making began; None without a plan.
        changes: What has changed since then.
        counts: The lifts of the plan on disk; None if there is none.
        holds: Whether the plan on disk is of what is shown, but for obstructions that a watch is about to answer.
    """

    state: PlanIs
    title: str
    words: str
    since: datetime | None = None
    changes: tuple[str, ...] = ()
    counts: Counts | None = None
    holds: bool = False

    def to_dict(self) -> dict[str, Any]:
        """Return it as JSON."""
        counts = self.counts and asdict(self.counts) | {"words": self.counts.words}
        since = self.since and self.since.isoformat(timespec="seconds")
        return {
            "state": self.state.value,
            "title": self.title,
            "words": self.words,
            "since": since,
            "when": self.since and in_words(self.since),
            "changes": list(self.changes),
            "counts": counts,
            "holds": self.holds,
        }


def state_of(plan: Planned | None, job: Job | None = None) -> PlanState:
    """Return the state of a site's plan.

    Args:
        plan: The newest plan on disk; None if there is none that can be read.
        job: What is under way for the site; None if nothing is.
    """
    counts = None if plan is None else plan.counts
    shown = "" if plan is None else f" Shown is the plan of {in_words(plan.since)}: {plan.counts.words}."
    if job is not None and job.makes:
        return _said(PlanIs.WORKING, None, f"since {in_words(job.since)}.{shown}", job.since, job.changes, counts)
    if plan is None:
        return PlanState(PlanIs.NONE, _TITLES[PlanIs.NONE], "No plan of this site yet.")
    told = f"of {in_words(plan.since)}: {plan.counts.words}."
    if job is not None and not job.is_stuck and not plan.changes and (plan.obstructions or job.is_pending):
        return _said(PlanIs.WORKING, _REVISED, told, plan.since, plan.obstructions, counts)
    changes = (*plan.changes, *plan.obstructions)
    return _said(PlanIs.EARLIER if changes else PlanIs.CURRENT, None, told, plan.since, changes, counts)


def _said(
    state: PlanIs,
    title: str | None,
    told: str,
    since: datetime,
    changes: Sequence[str],
    counts: Counts | None,
) -> PlanState:
    title = title or _TITLES[state]
    more = f" Changed since: {', '.join(changes)}." if changes else ""
    holds = state is PlanIs.CURRENT or title == _REVISED
    return PlanState(state, title, f"{title}, {told}{more}", since, tuple(changes), counts, holds)


def in_words(at: datetime) -> str:
    """Return a date and a clock time, such as ``1 Dec 2026 09:12``."""
    return f"{at.day} {at:%b %Y %H:%M}"
