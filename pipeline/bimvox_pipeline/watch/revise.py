"""Revises the watched plan part by part, the first lifts first: plan, prove, write, report."""

from __future__ import annotations

import io
import time
from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass
from functools import cache, partial
from typing import Any

from bimvox.files import write_atomically
from bimvox.log.bundle import SiteWriter
from bimvox.log.recorder import write_log
from bimvox.planning.preparation import Preparation
from bimvox.planning.stage import Propose
from bimvox.records.lift import LiftPlan
from bimvox.revision.current_plan import RetrainedPolicy, RevisionPart, RevisionRequest
from bimvox.revision.revise import revise
from bimvox.site.site import Site
from bimvox.stop.redirect import HOLD_S
from bimvox.workers import ALONE, Workers
from bimvox_pipeline.plan import infeasible_lifts
from bimvox_pipeline.watch.log import segment_file
from bimvox_pipeline.watch.plan import WatchedPlan, event_fields, ms_since, stop_events, transit
from bimvox_pipeline.watch.simulate import PlanClock

_STAGES = ("read", "plan", "prove", "write")
_FIRST = 20
"""New lifts in a part; the first part is written before the others are planned."""
_APART_NS = 1_000_000
"""Shortest time between two changes on the site's clock, which stands still while a watch resumes."""


@dataclass(frozen=True, slots=True, eq=False)
class Change:
    """The reason for a revision.

    Attributes:
        site: The site with its current obstructions.
        content: The obstruction file's bytes, for the log.
        started_s: When it was noticed, on the monotonic clock.
        better: A policy that was trained further.
        policy: Its id.
    """

    site: Site
    content: Mapping[str, bytes]
    started_s: float
    better: RetrainedPolicy | None = None
    policy: str | None = None


@dataclass(frozen=True, slots=True, eq=False)
class _Revised:
    """A part of a revision that is on disk.

    Attributes:
        part: The part, with the plan after it.
        document: Its document.
    """

    part: RevisionPart
    document: dict[str, Any]


class Reviser:
    """Makes revisions.

    Args:
        plan: The current plan, which is updated.
        preparation: Contacts, order and yard of its site.
        clock: The site's clock; None if the plan is not carried out.
        workers: Share the work; they know the site and its preparation.

    Attributes:
        preparation: See above.
        propose: The policy; None for search alone.
        known_shapes: See ``verify_plan``.
    """

    def __init__(
        self, plan: WatchedPlan, preparation: Preparation, clock: PlanClock | None, workers: Workers = ALONE
    ) -> None:
        self._plan, self.preparation, self._clock, self._workers = plan, preparation, clock, workers
        self.propose: Propose | None = None
        self.known_shapes: set[int] = set()
        self._sites: SiteWriter | None = None

    def know(self, site: Site) -> None:
        """Encode the site, so that only the differences of later ones have to be encoded."""
        self._sites = SiteWriter(site)

    def revise(self, change: Change) -> Generator[_Revised, None, None]:
        """Revise the plan part by part; a part is on disk before it is yielded.

        Raises:
            BimvoxError: If a part cannot be made or written; the parts before it remain valid.
        """
        plan = self._plan
        assert plan.current is not None
        before = plan.current.plan
        now_ns = None if self._clock is None else max(self._clock.at_ns(change.started_s), _after_all(before))
        making = _Making(plan, change, before, now_ns, self._site_bytes(change.site), self._workers)
        request = RevisionRequest(
            change.site,
            self.preparation,
            self.propose,
            _FIRST,
            now_ns,
            HOLD_S if self._clock is None else max(HOLD_S, self._clock.hold_s(len(change.site.cranes))),
            change.better,
            self._workers,
        )
        with self._workers.knowing(change.site):
            for part in revise(plan.current, request, known_shapes=self.known_shapes, on_verdict=making.note_verdict):
                yield _Revised(part, making.write(part))

    def _site_bytes(self, site: Site) -> Callable[[], bytes]:
        if self._sites is None:
            self.know(site)
        assert self._sites is not None
        return partial(self._sites.to_bytes, site)


class _Making:
    """One revision, with the times of its stages."""

    def __init__(
        self,
        plan: WatchedPlan,
        change: Change,
        before: LiftPlan,
        now_ns: int | None,
        site_bytes: Callable[[], bytes],
        workers: Workers,
    ) -> None:
        self._site_bytes, self._workers = cache(site_bytes), workers
        self._plan, self._change, self._before, self._now_ns = plan, change, before, now_ns
        self._event = "replanned" if change.better is None else "retrained"
        self._marks = [change.started_s, time.monotonic()]  # noticed, read
        self._noted_s = 0.0
        self._verdict_s: float | None = None
        self._retimed: set[int] = set()
        self._cells, self._ids = 0, frozenset[str]()
        self._number = 0

    def note_verdict(self) -> None:
        """Record the time at which it is known which of the decided lifts can be planned."""
        self._noted_s = time.monotonic()

    def _document(self, part: RevisionPart) -> dict[str, Any]:
        """Return the document of a part without its times."""
        plan, now_ns = part.current.plan, self._now_ns
        event = self._event if self._number == 0 else "continued"
        retimed = self._retimed | set(part.retimed)
        document = self._plan.document(event, plan, self._before, self._change.started_s, retimed)
        document |= {
            "revision": self._plan.revision + 1,
            "changed_cells": self._cells + part.change.cells,
            "obstructions": sorted(self._ids | part.change.ids),
            "pending": [_name(plan, order) for order in sorted(part.current.pending)],
            "undecided": [_name(plan, order) for order in sorted(part.current.undecided)],
            "blocked": infeasible_lifts(plan, part.current.motions.values()),
        }
        if self._change.policy is not None:
            document["policy"] = self._change.policy
        return document if now_ns is None else document | transit(part, now_ns)

    def _segment(self, part: RevisionPart, document: dict[str, Any]) -> bytes:
        now_ns = self._now_ns
        stops = [] if now_ns is None else stop_events(part, document, now_ns)
        record = self._plan.segment(part, self._change.content, event_fields(document), stops, now_ns or 0)
        stream = io.BytesIO()
        write_log(stream, record, self._site_bytes(), self._workers)
        return stream.getvalue()

    def write(self, part: RevisionPart) -> dict[str, Any]:
        """Write the segment of a proven part, make it the current plan, and return its document."""
        self._marks += [self._noted_s, time.monotonic()]
        plan, document = self._plan, self._document(part)
        target = segment_file(plan.target, plan.revision + 1)
        write_atomically(target, self._segment(part, document))
        plan.revision, plan.current, plan.content = plan.revision + 1, part.current, self._change.content
        if self._now_ns is not None:
            plan.carried_out_ns = self._now_ns
        self._marks.append(time.monotonic())
        started_s = self._change.started_s
        verdict_s = self._noted_s if self._verdict_s is None else self._verdict_s
        if not part.current.undecided:
            self._verdict_s = verdict_s
        document |= {
            "verdict_ms": ms_since(started_s, verdict_s),
            "segment": str(target),
            "latency_ms": ms_since(started_s, self._marks[-1]),
        }
        document["stages_ms"] = {
            stage: round(1000.0 * (after - at), 1)
            for stage, at, after in zip(_STAGES, self._marks[:-1], self._marks[1:], strict=True)
        }
        if not part.current.pending:
            document["all_ms"] = document["latency_ms"]
        self._marks = [self._marks[-1], self._marks[-1]]
        self._retimed |= set(part.retimed)
        self._cells += part.change.cells
        self._ids |= part.change.ids
        self._number += 1
        return document


def _after_all(plan: LiftPlan) -> int:
    """Return the earliest time on the site's clock for the next change: after all earlier ones."""
    return plan.history[-1].until_ns + _APART_NS if plan.history else 0


def _name(plan: LiftPlan, order: int) -> str:
    return next(plan.site.components[lift.component].id for lift in plan.lifts if lift.order == order)
