"""The current plan of a watch, with its revision number, its inputs and its logs."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from bimvox.library.plan import log_of
from bimvox.library.prove import Planned
from bimvox.library.site import LoadedSite
from bimvox.log.plan_json import HELD_CRANES_FILE, HELD_FILE, held_files, held_in
from bimvox.log.plan_log import LogEvent, PlanLog
from bimvox.log.segments import FIRST_PLAN, NOW_NS, REPLAN_EVENT, first_plan_of, segment_of
from bimvox.policy.choice import PolicyInUse
from bimvox.records.lift import LiftPlan, Method, by_change
from bimvox.records.motion import LiftMotion, PhaseName
from bimvox.records.proof import Severity
from bimvox.remarks.rules import none_inside
from bimvox.revision.current_plan import CurrentPlan, RevisionPart, current_plan_of
from bimvox.site.site import Site
from bimvox.stop.brake_axes import STOP_EVENT
from bimvox.stop.redirect import Held, Redirected
from bimvox_pipeline.plan import infeasible_lifts
from bimvox_pipeline.watch.log import segments_on_disk


def _outcome(plan: LiftPlan, before: LiftPlan | None, retimed: Collection[int] = ()) -> dict[str, Any]:
    """Return the ids of the lifts that kept their path, got a new path, got only a new motion, or are infeasible.

    Args:
        plan: The current plan.
        before: The plan before the change; None if there was none, so that all lifts are new.
        retimed: Orders of the lifts with a new motion.
    """
    kept, replanned, infeasible = by_change(before.lifts if before else (), plan.lifts)
    lists = {
        "kept": kept,
        "replanned": replanned,
        "infeasible": infeasible,
        "retimed": [lift for lift in kept if lift.order in retimed],
    }
    components = plan.site.components
    return {key: [components[lift.component].id for lift in lifts] for key, lifts in lists.items()}


def event_fields(document: dict[str, Any]) -> dict[str, str]:
    """Return the fields of a revision's event in the log: counts, ids, and why lifts are infeasible."""
    fields = {
        "revision": str(document["revision"]),
        "event": document["event"],
        "changed_cells": str(document["changed_cells"]),
        "kept": str(len(document["kept"])),
        "retimed": str(len(document["retimed"])),
    }
    for key in ("obstructions", "replanned", "infeasible"):
        fields[key] = " ".join(document[key])
    for entry in document.get("blocked", ()):
        by = f" ({', '.join(entry['blocked_by'])})" if entry["blocked_by"] else ""
        fields[f"why {entry['component']}"] = f"{entry['reason']}{by}"
    return fields


def transit(part: RevisionPart, now_ns: int) -> dict[str, Any]:
    """Return what happened to the lifts that were under way when the change was noticed."""
    stops = [_stopped(part, one) for one in _stops(part)]
    fields: dict[str, Any] = {"time_s": round(now_ns / 1e9, 3), "stopped": stops[0] if stops else None}
    if part.current.plan.site.has_several_cranes:
        fields["all_stopped"] = stops
    return fields


def _stops(part: RevisionPart) -> list[Redirected | Held]:
    """Return the stopped lifts, held ones first."""
    return sorted(part.stops, key=lambda stop: (not isinstance(stop, Held), stop.stop is None))


def _stopped(part: RevisionPart, found: Redirected | Held) -> dict[str, Any]:
    stop, held, order = found.stop, isinstance(found, Held), found.lift.order
    # With several cranes a load may have to wait for longer than it was held for.
    motion = None if held else part.current.motions.get(order, found.motion)
    return {
        "component": part.current.plan.site.components[found.lift.component].id,
        "how": found.how,
        "safe": not isinstance(found, Held) or found.is_safe,
        "held": held,
        "rest_s": None if stop is None else round(stop.end_ns / 1e9, 3),
        "brakes_for_s": None if stop is None else round(stop.duration_s, 3),
        "swings_m": None if stop is None else round(stop.swing_m, 3),
        "goes_on_s": None if motion is None else _goes_on_s(motion),
    }


def stop_events(part: RevisionPart, document: dict[str, Any], now_ns: int) -> list[LogEvent]:
    """Return the log's events of stops."""
    events = []
    stopped = [] if document.get("stopped") is None else document.get("all_stopped", [document["stopped"]])
    for one, said in zip(_stops(part), stopped, strict=False):
        until_ns = now_ns if one.stop is None else one.stop.end_ns
        events.append(LogEvent(STOP_EVENT, now_ns, until_ns, {key: str(value) for key, value in said.items()}))
    return events


def revision_events(part: RevisionPart, document: dict[str, Any], now_ns: int) -> tuple[LogEvent, ...]:
    """Return the events of a revision for viewers: its changes and its stops."""
    replanned = LogEvent(REPLAN_EVENT, now_ns, now_ns, event_fields(document))
    return replanned, *stop_events(part, document, now_ns)


def _goes_on_s(motion: LiftMotion) -> float | None:
    ends = [phase.end_ns for phase in motion.phases if phase.name is PhaseName.STOP]
    return round(ends[-1] / 1e9, 3) if ends else None


def left_to_search(part: RevisionPart) -> set[int]:
    """Return the components of the lifts made in a part whose paths were found by search."""
    made = set(part.replanned)
    lifts = part.current.plan.lifts
    return {lift.component for lift in lifts if lift.order in made and lift.method is Method.SEARCH}


def notes_about(site: Site) -> list[str]:
    """Return the notes about the obstructions of a site; that none is inside comes first."""
    said = none_inside(site)
    return [*([] if said is None else [f"{Severity.SERIOUS}: {said}"]), *site.obstruction_notes]


class WatchedPlan:
    """The current plan.

    Args:
        loaded: The site as loaded.
        policy: What proposes paths.
        target: The whole log.
        seed: Seed of the training, for the log.

    Attributes:
        loaded: The site as loaded.
        policy: What proposes paths.
        target: The whole log.
        seed: Seed of the training.
        is_carried_out: Whether it is carried out against a clock.
        revision: Number of the last revision; -1 before the first.
        current: The plan; None before the first.
        content: The bytes of the obstruction file, by its name in the log.
        first: Digest of the plan with which the watch began.
        carried_out_ns: Time on the site's clock when the last revision was made.
    """

    def __init__(self, loaded: LoadedSite, policy: PolicyInUse, target: Path, seed: int) -> None:
        self.loaded, self.policy, self.target, self.seed = loaded, policy, target, seed
        self.is_carried_out = False
        self.revision = max(segments_on_disk(target), default=-1)
        self.current: CurrentPlan | None = None
        self.content: Mapping[str, bytes] = {}
        self.first = ""
        self.carried_out_ns = 0

    @property
    def is_left_over(self) -> bool:
        """Whether lifts are pending that can be planned now."""
        current = self.current
        return current is not None and bool(current.pending) and current.held is None

    def is_of_these_files(self, log: PlanLog) -> bool:
        """Return whether a log carries the site's files as they are now; tables like ``[project]`` change no plan."""
        return self.loaded.files.items() <= log.attachments.items()

    def take_up(self, log: PlanLog) -> None:
        """Continue from the plan of a log."""
        self.revision, self.first = max(self.revision, log.revision), first_plan_of(log)
        self.current = current_plan_of(log.plan, log.motions)
        self.carried_out_ns = int(log.metadata.get(NOW_NS, 0))
        if self.is_carried_out:
            self.current = replace(self.current, held=held_in(log.attachments))
        known = {*self.loaded.files, HELD_FILE, HELD_CRANES_FILE}
        self.content = {name: log.attachments[name] for name in log.attachments if name not in known}

    def first_log(self, planned: Planned, content: Mapping[str, bytes]) -> PlanLog:
        """Return the whole log of a first plan, which is the next revision."""
        files = self.loaded.files | dict(content)
        log = log_of(planned, self.loaded, self.policy, files, seed=self.seed, revision=self.revision + 1)
        self.first = first_plan_of(log)
        return log

    def whole_log(self) -> PlanLog:
        """Return the whole log of the current plan."""
        assert self.current is not None
        planned = Planned(self.current.plan, self.current.chain)
        files = self.loaded.files | dict(self.content) | _held(self.current)
        record = log_of(planned, self.loaded, self.policy, files, seed=self.seed, revision=self.revision)
        return replace(record, metadata={**record.metadata, **self._about(self.carried_out_ns)})

    def segment(
        self,
        part: RevisionPart,
        content: Mapping[str, bytes],
        fields: dict[str, str],
        more: Sequence[LogEvent] = (),
        now_ns: int = 0,
    ) -> PlanLog:
        """Return the segment of the next revision.

        Args:
            part: The plan then.
            content: The obstruction file's bytes.
            fields: Fields of its event.
            more: Other events.
            now_ns: Time on the site's clock.
        """
        planned, revision = Planned(part.current.plan, ()), self.revision + 1
        files = self.loaded.files | dict(content) | _held(part.current)
        bare = log_of(planned, self.loaded, self.policy, files, seed=self.seed, revision=revision)
        return segment_of(
            replace(bare, metadata={**bare.metadata, **self._about(now_ns)}),
            part.current.motions,
            part.made,
            part.current.pending,
            fields,
            more,
        )

    def document(
        self,
        event: str,
        plan: LiftPlan | None,
        before: LiftPlan | None,
        started_s: float,
        retimed: set[int] | None = None,
    ) -> dict[str, Any]:
        """Return the document of a change.

        Args:
            event: What happened.
            plan: The current plan; None if there is none.
            before: The plan before.
            started_s: When the change was noticed, on the monotonic clock.
            retimed: Orders of the lifts with a new motion.
        """
        document: dict[str, Any] = {"event": event, "revision": self.revision, "changed_cells": 0}
        if plan is None:
            document |= {"kept": [], "replanned": [], "infeasible": [], "retimed": []}
        else:
            document |= _outcome(plan, before, retimed or ()) | {"notes": notes_about(plan.site)}
        return document | {"log": str(self.target), "latency_ms": ms_since(started_s)}

    def unchanged(
        self, event: str, started_s: float, message: str | None = None, notes: Sequence[str] = ()
    ) -> dict[str, Any]:
        """Return the document of an event that does not change the plan."""
        plan = self.current.plan if self.current is not None else None
        document = self.document(event, plan, plan, started_s) | {"notes": list(notes)}
        if plan is not None:
            document["blocked"] = infeasible_lifts(plan, self.current.motions.values() if self.current else ())
        return document | ({"message": message} if message else {})

    def _about(self, now_ns: int) -> dict[str, str]:
        """Return the log's metadata: the first plan, and the time on the site's clock."""
        return {FIRST_PLAN: self.first} | ({NOW_NS: str(now_ns)} if self.is_carried_out else {})


def _held(current: CurrentPlan) -> dict[str, bytes]:
    """Return the held cranes as files of the log."""
    return {} if current.held is None else held_files(current.held)


def ms_since(started_s: float, until_s: float | None = None) -> float:
    """Return the milliseconds from one time on the monotonic clock to another, or to now."""
    return round(((time.monotonic() if until_s is None else until_s) - started_s) * 1000.0, 1)


# How a caller wishes a plan to be watched.


@dataclass(frozen=True, slots=True)
class WatchWish:
    """How the obstruction file is read, and what happens to the plan meanwhile.

    Attributes:
        once: Look once and return.
        poll_s: Read the file at this interval instead of waiting for events: for network shares.
        speed: Carry the plan out against a clock that runs this many times as fast as the wall clock.
        retrain: Budget, in environment steps, of more training during the watch if the policy fails lifts; 0: none.
        serve: ``[HOST:]PORT`` of a websocket for viewers.
        traffic: Seed of people and vehicles among which the plan is carried out, or a file with their tracks.
        jobs: Number of processes that share the work; None: one per processor.
        clock_started: Told the time in seconds from which the site's clock runs, when it starts.
    """

    once: bool = False
    poll_s: float | None = None
    speed: float | None = None
    retrain: int = 0
    serve: str | None = None
    traffic: str | None = None
    jobs: int | None = None
    clock_started: Callable[[float], object] | None = None
