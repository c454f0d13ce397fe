"""``bimvox watch``: a plan kept true to an obstruction file.

Every accepted content of the file makes a revision: a segment of the log, ``LOG.rNNNN.mcap``, with the lifts that are
new in it; ``LOG.mcap`` is the whole newest plan, written again when nothing is going on and at the end. Lifts that the
change does not meet are kept as they are. Content that cannot be used changes nothing: the last good plan stands and
the next good content is taken.
"""

from __future__ import annotations

import gc
import threading
import time
from collections.abc import Generator, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bimvox.errors import BimvoxError, FileError, InputError, PolicyError
from bimvox.site.obstructions import EMPTY, ObstructionSet
from pipeline.artifacts import check_output, default_output, write_atomically
from pipeline.file_watch import FileState, changes, state_of
from pipeline.load_site import LoadedSite, load_obstructions, load_site
from pipeline.plan import document_of, log_of, obstructed, policy_of, prepared, seed_of, write_log_file
from pipeline.policy_choice import PolicyInUse
from pipeline.progress import Progress, SilentProgress
from pipeline.prove import Planned, plan_and_prove
from pipeline.simulate import NOW_NS, Execution, PlanClock
from pipeline.watch_documents import blocked, event_fields, outcome, stop_events, transit
from pipeline.watch_live import LiveView, address_of
from pipeline.watch_log import WholeLog, read_newest, segment_file, segments_on_disk
from pipeline.watch_retrain import Retraining

if TYPE_CHECKING:
    from bimvox.log.live_server import LiveServer
    from bimvox.log.plan_log import LogEvent, PlanLog
    from bimvox.planning.assembly import Preparation
    from bimvox.planning.lift import LiftPlan
    from bimvox.site.site import Site
    from bimvox.trajectory.revise import Better, Part, Standing

_STAGES = ("read", "plan", "prove", "write")
_FIRST = 20
"""Lifts made anew that are written first."""
_MOST_BYTES = 512 << 20
"""A larger obstruction file is refused: reading it would take all memory."""
_APART_NS = 1_000_000
"""Changes are at least so far apart on the site's clock, which stands while a plan is taken up."""
_SETTLE_S = 0.05
"""A file that cannot be used may be half written: it is looked at again after this time before it is refused."""
_RETRY_S = (1.0, 30.0)
"""Shortest and longest wait before what could not be read or written is tried again."""


def watch(
    obstructions: Path,
    *,
    site: Path,
    out: Path | None = None,
    once: bool = False,
    seed: int | None = None,
    policy: str | None = None,
    steps: int | None = None,
    poll_s: float | None = None,
    speed: float | None = None,
    retrain: int = 0,
    serve: str | None = None,
    progress: Progress,
    stop: threading.Event | None = None,
) -> Generator[dict[str, Any], None, None]:
    """Plan a site, and plan it again whenever the obstruction file changes.

    Args:
        obstructions: The file; where it does not exist, nothing is in the way.
        site: The site file.
        out: The log; default: the site's name with ``.mcap``, in the current folder. Where it exists and belongs to
            this site, its plan is taken up, with the segments after it.
        once: Look once and leave.
        seed: Seed of the training; default: the site file's.
        policy: Id of a policy of the store.
        steps: Training budget in environment steps.
        poll_s: Look at the file this often instead of waiting for events: for network shares.
        speed: Carry the plan out against a clock that goes so many times as fast as the wall's.
        retrain: Budget, in environment steps, of more training beside the watch, where the policy fails lifts; 0: none.
        serve: ``[HOST:]PORT`` of a websocket on which viewers follow.
        progress: Told of the stages of the first plan.
        stop: Ends the watch.

    Yields:
        One document per change, see ``bimvox watch --json``.
    """
    target = out or default_output(site, ".mcap")
    server = None if serve is None else _server(serve, progress)
    check_output(target, inputs=[site, obstructions])
    loaded = load_site(site, progress)
    check_output(target, inputs=[site, obstructions, loaded.config.model.path])
    preparation = prepared(loaded.site, progress)
    chosen = policy_of(loaded, loaded.site, preparation, policy=policy, seed=seed, steps=steps, progress=progress)
    if speed is not None and loaded.site.crane is None:
        raise InputError("without a crane there is no motion to carry out", hint="leave --simulate out")
    clock = None if speed is None else PlanClock(speed)
    watcher = Watcher(loaded, preparation, chosen, obstructions, target, seed_of(loaded, seed), progress, clock)
    watcher.retrain(retrain)
    if server is not None:
        watcher.live = LiveView(server, clock)
    yield from follow(watcher, once=once, poll_s=poll_s, stop=stop or threading.Event())


def follow(watcher: Watcher, *, once: bool, poll_s: float | None, stop: threading.Event) -> Iterator[dict[str, Any]]:
    """Take up or make the first plan, then revise it at every change of the file; see ``watch``."""
    file = watcher.file
    start = state_of(file)
    try:
        yield from watcher.take_up(start)
        if once:
            return
        watcher.warm()
        watcher.begin()
        watcher.progress.note(f"watching {file}")
        watcher.progress = SilentProgress()
        start = state_of(file, watcher.files) if watcher.files else start
        for state in changes(file, lambda: watcher.files, stop, start, poll_s=poll_s, again=watcher.wants_another_look):
            yield from watcher.change(state)
    except KeyboardInterrupt:
        watcher.told.note("stopped; the last revision stands")
    finally:
        watcher.close()


def _server(address: str, progress: Progress) -> LiveServer:
    from bimvox.log.live_server import LiveServer

    server = LiveServer(*address_of(address))
    progress.note(f"viewers may look on at ws://{server.address}")
    return server


class Watcher:
    """Keeps the plan that stands, and revises it.

    Args:
        loaded: The site as loaded.
        preparation: What was prepared for it.
        policy: What proposes paths.
        file: The obstruction file.
        target: The log.
        seed: Seed of the training, for the log.
        progress: Told of the stages.
        clock: The site's clock, where the plan is carried out.

    Attributes:
        file: The obstruction file.
        told: Told of what a user should know.
        progress: Told of the stages of a change.
        files: What the obstruction file refers to.
        is_cold: Whether the first change would be slower than the others.
        live: Shows the plan to viewers, where there are any.
    """

    def __init__(
        self,
        loaded: LoadedSite,
        preparation: Preparation,
        policy: PolicyInUse,
        file: Path,
        target: Path,
        seed: int,
        progress: Progress,
        clock: PlanClock | None = None,
    ) -> None:
        self._retraining: Retraining | None = None
        self.live: LiveView | None = None
        self._execution = None if clock is None else Execution(clock)
        self._carried_out_ns = 0
        self._taken: str | None = None
        self._loaded, self._preparation, self._policy = loaded, preparation, policy
        self.file, self._target, self._seed = file, target, seed
        self.progress, self.told = progress, progress
        self.is_cold = True
        self.files: tuple[Path, ...] = ()
        self._revision = max(segments_on_disk(target), default=-1)
        self._standing: Standing | None = None
        self._content: dict[str, bytes] = {}
        self._whole = WholeLog(target, progress)
        self._known_shapes: set[int] = set()
        self._propose: Any = None
        self._last_refusal: str | None = None
        self._retry_at_s: float | None = None

    @property
    def standing(self) -> Standing | None:
        """The plan that stands."""
        return self._standing

    @property
    def revision(self) -> int:
        """Number of the last revision."""
        return self._revision

    @property
    def _is_left_over(self) -> bool:
        """Whether lifts are still to be planned that nothing keeps from being planned."""
        standing = self._standing
        return standing is not None and bool(standing.pending) and standing.held is None

    def take_up(self, state: FileState) -> Iterator[dict[str, Any]]:
        """The first plan: the one on disk where it is of this site and of these obstructions, else a new one."""
        from bimvox.planning.rollout import proposer
        from bimvox.trajectory.revise import standing_of

        self._taken = state.digest
        network = self._policy.network
        self._propose = None if network is None else proposer(network)
        before = read_newest(self._target, self._loaded.site.fixed_digest, self.progress)
        if before is not None:
            log = before.log
            self._revision = max(self._revision, log.revision)
            self._standing = standing_of(log.plan, log.motions)
            self._carried_out_ns = int(log.metadata.get(NOW_NS, 0))
            if self._execution is not None:
                self._execution.clock.stand_at(self._carried_out_ns)
            self._content = {name: log.attachments[name] for name in log.attachments if name not in self._loaded.files}
            if not before.behind:
                self._keep(log.revision)
        try:
            wanted, content = self._read(state)
            site = obstructed(self._loaded.site, wanted, self.progress)
        except BimvoxError as error:
            if self._standing is None:
                raise
            yield self._refused("rejected", state.seen_s, error)
            return
        if self._standing is None:
            yield self._first_plan(site, content, state.seen_s)
        elif self._standing.plan.site.digest == site.digest and not self._standing.pending:
            yield self._unchanged("unchanged", state.seen_s)
            if before is not None and before.behind:
                self._whole.offer(self._record(self._standing))
        else:
            yield from self._revise(site, content, state.seen_s)

    def change(self, state: FileState) -> Iterator[dict[str, Any]]:
        """What the file holds now, planned; or why the last good plan stands."""
        self._whole.hold()
        try:
            yield from self._change(state)
            if self._retraining is not None and self._retraining.is_done:
                yield from self._retrained(state.seen_s)
        finally:
            self._whole.resume()

    def wants_another_look(self) -> bool:
        """Whether the last content could not be taken for a reason that may pass without a change of the file."""
        news = self._execution is not None and self._execution.has_news(self._standing)
        trained = self._retraining is not None and self._retraining.is_done
        return (
            self._is_left_over
            or news
            or trained
            or (self._retry_at_s is not None and time.monotonic() >= self._retry_at_s)
        )

    def warm(self) -> None:
        """Revise once in vain: compiled code is loaded and whatever is built once is there before the first change."""
        from pipeline.watch_warm import revise_in_vain

        if self._standing is not None:
            revise_in_vain(self._standing, self._preparation, self._propose, self._known_shapes, self._segment)
        # What is there now stays: the collector need not look through it at every change.
        gc.collect()
        gc.freeze()
        self.is_cold = False

    def retrain(self, steps: int) -> None:
        """From now on, train the policy further beside the watch where it fails lifts; with 0 steps, do not."""
        if steps and self._policy.network is not None:
            self._retraining = Retraining(self._preparation, self._policy, self._seed, steps)

    def begin(self) -> None:
        """Begin to carry the plan out, where it is; from where it was left."""
        if self._execution is not None:
            self._execution.clock.start(self._carried_out_ns)
        self._show()

    def close(self) -> None:
        """End what goes on beside, and write the whole log if it is behind."""
        if self.live is not None:
            self.live.close()
        if self._retraining is not None:
            self._retraining.cancel()
        self._whole.close()

    def _keep(self, revision: int) -> None:
        """Keep the plan that was taken up: the segments to come rest on it, and the whole log will be newer."""
        kept = segment_file(self._target, revision)
        if not kept.exists():
            write_atomically(kept, self._target.read_bytes())

    def _change(self, state: FileState) -> Iterator[dict[str, Any]]:
        if self._execution is not None:
            passed = self._execution.news(self._standing)
            if passed:
                self._show()
            for news in passed:
                yield news | {"revision": self._revision, "log": str(self._target)}
            same = state.digest == self._taken and self._taken is not None
            if same and not self._is_left_over and self._retry_at_s is None:
                return
        elif self._retraining is not None and self._retraining.is_done and state.digest == self._taken:
            return
        self._taken = state.digest
        if state.digest is None:
            self._retry_at_s = None
            if self._last_refusal != "missing":
                self._last_refusal = "missing"
                yield self._unchanged("missing", state.seen_s, "the file is gone; the last good plan stands")
            return
        try:
            wanted, content = self._read(state)
            site = obstructed(self._loaded.site, wanted, self.progress)
        except BimvoxError as error:
            time.sleep(_SETTLE_S)
            if state_of(self.file).digest != state.digest and not self.files:
                return  # it was being written: what it holds now is looked at next
            if self._last_refusal != str(error):
                yield self._refused("rejected", state.seen_s, error)
            self._try_again(state.seen_s)
            return
        standing = self._standing
        if standing is not None and standing.plan.site.digest == site.digest and not self._is_left_over:
            self._accepted()
            yield self._unchanged("unchanged", state.seen_s)
            return
        yield from self._revise(site, content, state.seen_s)

    def _read(self, state: FileState) -> tuple[ObstructionSet, dict[str, bytes]]:
        """Read the obstructions, and the file's bytes for the log."""
        if state.digest is None:
            self.progress.note(f"{self.file} does not exist yet: nothing is in the way")
            return EMPTY, {}
        try:
            size = self.file.stat().st_size
            if size > _MOST_BYTES:
                raise FileError(
                    self.file,
                    f"is too large ({size >> 20} MiB, at most {_MOST_BYTES >> 20})",
                    hint="give cells or boxes",
                )
            content = self.file.read_bytes()
            found = load_obstructions(self.file, self._loaded.site)
        except OSError as error:
            raise FileError(self.file, f"cannot be read: {error.strerror or error}") from error
        self.files = found.files
        return found, {f"obstructions{self.file.suffix.lower()}": content}

    def _first_plan(self, site: Site, content: dict[str, bytes], started_s: float) -> dict[str, Any]:
        from bimvox.trajectory.revise import standing_of

        planned = plan_and_prove(site, self._preparation, self._policy, progress=self.progress)
        self._known_shapes = set(range(len(site.components)))
        revision = self._revision + 1
        files = self._loaded.files | content
        record = log_of(planned, self._loaded, self._policy, files, seed=self._seed, revision=revision)
        segment = segment_file(self._target, revision)
        write_log_file(segment, record, inputs=[])
        write_atomically(self._target, segment.read_bytes())
        self._revision, self._content = revision, content
        self._standing = standing_of(planned.plan, planned.motions)
        document = self._document("planned", planned.plan, None, started_s)
        return document | {"segment": str(segment), "blocked": document_of(planned, self._policy)["infeasible"]}

    def _retrained(self, started_s: float) -> Iterator[dict[str, Any]]:
        """Ask the policy that came of a training for the lifts that it was trained for."""
        from bimvox.planning.rollout import proposer
        from bimvox.trajectory.revise import Better

        assert self._retraining is not None
        assert self._standing is not None
        components = frozenset(self._retraining.components)
        try:
            found = self._retraining.result()
        except PolicyError as error:
            yield self._refused("failed", started_s, error)
            return
        if found is None or found.network is None:
            yield self._unchanged("retrained", started_s, "no retrained policy was better: the search's paths stand")
            return
        better = Better(components, proposer(found.network))
        yield from self._revise(self._standing.plan.site, self._content, started_s, better, found.id)

    def _revise(
        self,
        site: Site,
        content: dict[str, bytes],
        started_s: float,
        better: Better | None = None,
        policy: str | None = None,
    ) -> Iterator[dict[str, Any]]:
        """Revise the plan part by part; a part is on disk before it is told of."""
        if self._retraining is not None:
            self._retraining.cancel()
        from bimvox.trajectory.revise import revise
        from bimvox.trajectory.underway import HOLD_S

        assert self._standing is not None
        before = self._standing.plan
        marks = [started_s, time.monotonic()]  # noticed, read
        verdict_s: list[float] = []
        clock = None if self._execution is None else self._execution.clock
        now_ns = None if clock is None else max(clock.at_ns(started_s), _after_all(before))
        parts = revise(
            self._standing,
            site,
            self._preparation,
            propose=self._propose,
            first=_FIRST,
            known_shapes=self._known_shapes,
            on_verdict=lambda: verdict_s.append(time.monotonic()),
            now_ns=now_ns,
            better=better,
            hold_s=HOLD_S if clock is None else max(HOLD_S, clock.hold_s),
        )
        event = first = "replanned" if better is None else "retrained"
        made: set[int] = set()
        searched: set[int] = set()
        changed_cells, obstructions = 0, frozenset[str]()
        while True:
            try:
                part = next(parts, None)
                if part is None:
                    return
                marks += [verdict_s[-1], time.monotonic()]
                made |= set(part.retimed)
                changed_cells += part.change.cells
                obstructions |= part.change.ids
                document = self._document(event, part.standing.plan, before, started_s, made)
                document |= {
                    "revision": self._revision + 1,
                    "changed_cells": changed_cells,
                    "obstructions": sorted(obstructions),
                    "pending": [_name(part.standing.plan, order) for order in sorted(part.standing.pending)],
                    "blocked": blocked(part.standing.plan),
                    "verdict_ms": _ms_since(started_s, verdict_s[-1] if event == first else verdict_s[0]),
                }
                if policy is not None:
                    document["policy"] = policy
                stops: list[LogEvent] = []
                if now_ns is not None:
                    document |= transit(part, now_ns)
                    stops = stop_events(part, document, now_ns)
                    self._carried_out_ns = now_ns
                segment = self._write(part, content, event_fields(document), stops)
            except BimvoxError as error:
                if self._last_refusal != str(error):
                    yield self._refused("failed", started_s, error)
                if isinstance(error, FileError):
                    self._try_again(started_s)
                return
            self._accepted()
            marks.append(time.monotonic())
            document |= {"segment": str(segment), "latency_ms": _ms_since(started_s, marks[-1])}
            document["stages_ms"] = {
                stage: round(1000.0 * (after - at), 1)
                for stage, at, after in zip(_STAGES, marks[:-1], marks[1:], strict=True)
            }
            marks = [marks[-1], marks[-1]]
            searched |= _left_to_search(part)
            if not part.standing.pending:
                document["all_ms"] = document["latency_ms"]
                self._whole.offer(self._record(part.standing))
                if self._retraining is not None and better is None:
                    self._retraining.begin(site, searched)
            self._show()
            yield document
            event = "continued"
            if part.standing.held is not None:
                return  # it waits for a change
            if part.standing.pending and self._is_behind():
                return  # what is pending goes with the next change

    def _write(
        self, part: Part, content: dict[str, bytes], fields: dict[str, str], more: Sequence[LogEvent] = ()
    ) -> Path:
        """Write a part's segment; only then does it stand."""
        revision = self._revision + 1
        target = segment_file(self._target, revision)
        record = self._segment(part, revision, content, fields, more)
        write_log_file(target, record, inputs=[])
        self._revision, self._standing, self._content = revision, part.standing, content
        return target

    def _show(self) -> None:
        """Show viewers what stands."""
        from bimvox.log.plan_log import PlanLog

        if self.live is not None and self._standing is not None:
            self.live.show(PlanLog(plan=self._standing.plan, motions=self._standing.chain, revision=self._revision))

    def _segment(
        self,
        part: Part,
        revision: int,
        content: dict[str, bytes],
        fields: dict[str, str],
        more: Sequence[LogEvent] = (),
    ) -> PlanLog:
        from bimvox.log.segments import segment_of

        files = self._loaded.files | content
        planned = Planned(part.standing.plan, ())
        bare = log_of(planned, self._loaded, self._policy, files, seed=self._seed, revision=revision)
        return segment_of(
            part.standing.plan,
            part.standing.motions,
            part.made,
            part.standing.pending,
            revision=revision,
            event=fields,
            attachments=bare.attachments,
            metadata={**bare.metadata, **self._carried_out()},
            more=more,
        )

    def _record(self, standing: Standing) -> PlanLog:
        """The whole log of what stands."""
        planned = Planned(standing.plan, standing.chain)
        files = self._loaded.files | self._content
        record = log_of(planned, self._loaded, self._policy, files, seed=self._seed, revision=self._revision)
        return replace(record, metadata={**record.metadata, **self._carried_out()})

    def _carried_out(self) -> dict[str, str]:
        """How far the plan is carried out, for the log."""
        return {} if self._execution is None else {NOW_NS: str(self._carried_out_ns)}

    def _is_behind(self) -> bool:
        """Whether the file holds something else than what is being planned."""
        try:
            content = self.file.read_bytes()
        except OSError:
            return False
        return content not in self._content.values()

    def _accepted(self) -> None:
        self._last_refusal, self._retry_at_s = None, None

    def _try_again(self, started_s: float) -> None:
        """A disk may have room again, a file that is referred to may come: look again, more seldom if that is dear."""
        now_s = time.monotonic()
        self._retry_at_s = now_s + min(max(_RETRY_S[0], 10.0 * (now_s - started_s)), _RETRY_S[1])

    def _refused(self, event: str, started_s: float, error: BimvoxError) -> dict[str, Any]:
        self._last_refusal = str(error)
        return self._unchanged(event, started_s, str(error))

    def _unchanged(self, event: str, started_s: float, message: str | None = None) -> dict[str, Any]:
        plan = self._standing.plan if self._standing is not None else None
        return self._document(event, plan, plan, started_s) | ({"message": message} if message else {})

    def _document(
        self,
        event: str,
        plan: LiftPlan | None,
        before: LiftPlan | None,
        started_s: float,
        retimed: set[int] | None = None,
    ) -> dict[str, Any]:
        document: dict[str, Any] = {"event": event, "revision": self._revision, "changed_cells": 0}
        if plan is None:
            document |= {"kept": [], "replanned": [], "infeasible": [], "retimed": []}
        else:
            document |= outcome(plan, before, retimed or ())
        return document | {"log": str(self._target), "latency_ms": _ms_since(started_s)}


def _after_all(plan: LiftPlan) -> int:
    """The earliest time on the site's clock at which another change counts: after those that were before it."""
    return plan.history[-1].until_ns + _APART_NS if plan.history else 0


def _left_to_search(part: Part) -> set[int]:
    """Components of the lifts made anew in a part whose paths no policy found."""
    from bimvox.planning.lift import Method

    made = set(part.replanned)
    lifts = part.standing.plan.lifts
    return {lift.component for lift in lifts if lift.order in made and lift.method is Method.SEARCH}


def _name(plan: LiftPlan, order: int) -> str:
    return next(plan.site.components[lift.component].id for lift in plan.lifts if lift.order == order)


def _ms_since(started_s: float, until_s: float | None = None) -> float:
    return round(((time.monotonic() if until_s is None else until_s) - started_s) * 1000.0, 1)
