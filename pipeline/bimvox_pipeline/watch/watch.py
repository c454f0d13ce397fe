"""``bimvox watch``: keeps a plan up to date with an obstruction file.

Every accepted content of the file makes a revision: a segment of the log, ``LOG.rNNNN.mcap``, with the lifts that are
new in it; ``LOG.mcap`` is the whole newest plan, written when the watch is idle and at the end. Lifts that the change
does not affect are kept. Content that cannot be used changes nothing: the last good plan remains until usable content
follows.
"""

from __future__ import annotations

import gc
import threading
from collections.abc import Generator, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from bimvox.errors import BimvoxError, FileError, InputError, PolicyError
from bimvox.extras import require
from bimvox.files import check_output, default_output, write_atomically
from bimvox.library.arguments import PolicyWish, constants_of, workers_of
from bimvox.library.hand_over import is_of, may_go_to_others, with_cranes_of
from bimvox.library.plan import policy_of, seed_of
from bimvox.library.plan_value import write_log_file
from bimvox.library.prove import plan_and_prove, prepared
from bimvox.library.revise import insist_on_no_tandem
from bimvox.library.site import LoadedSite, load_site
from bimvox.library.verify import prove_plan
from bimvox.live.tracks import NamedTraffic
from bimvox.log.plan_json import HELD_CRANES_FILE
from bimvox.log.plan_log import LogEvent, PlanLog
from bimvox.planning.preparation import Preparation, preparation_in
from bimvox.planning.rollout import proposer
from bimvox.progress import Progress, SilentProgress
from bimvox.records.lift import Status
from bimvox.records.proof import counts_of
from bimvox.revision.current_plan import CurrentPlan, RetrainedPolicy, current_plan_of
from bimvox.site.build import with_digests
from bimvox.site.site import Site
from bimvox.undisturbed import interruptible
from bimvox.workers import ALONE, Workers
from bimvox_pipeline.plan import infeasible_lifts
from bimvox_pipeline.watch.file_watch import FileState, ObstructionReader, changes, state_of
from bimvox_pipeline.watch.live import DrivenLog, LiveView, Sink, driven_until_ns, server_at
from bimvox_pipeline.watch.log import Newest, WholeLog, keep_as_segment, read_newest, segment_file
from bimvox_pipeline.watch.plan import WatchedPlan, WatchWish, left_to_search, notes_about, revision_events
from bimvox_pipeline.watch.retrain import Retraining, warm_up, warm_workers
from bimvox_pipeline.watch.revise import Change, Reviser
from bimvox_pipeline.watch.simulate import Execution, PlanClock
from bimvox_pipeline.watch.traffic import carry_out, insist_on_one_crane, traffic_of


def watch(
    obstructions: Path,
    *,
    site: Path,
    out: Path | None = None,
    programme: Path | None = None,
    wish: PolicyWish = PolicyWish(),  # noqa: B008  (immutable)
    how: WatchWish = WatchWish(),  # noqa: B008  (immutable)
    progress: Progress,
) -> Generator[dict[str, Any], None, None]:
    """Plan a site, and revise the plan whenever the obstruction file changes.

    Args:
        obstructions: The obstruction file; if it does not exist, there are no obstructions.
        site: The site file.
        out: The log; default: the site's name with ``.mcap``, in the current folder. If it exists and belongs to this
            site, the watch continues from its plan and the segments after it.
        programme: Takes the place of the one that the site file names, as in ``bimvox plan``.
        wish: Which policy is wished, and its training.
        how: How the file is read, and what happens to the plan meanwhile.
        progress: Receives the stages of the first plan.

    Yields:
        One document of ``bimvox watch --json`` per change.
    """
    if how.retrain:
        require("train", "--retrain")
    target = out or default_output(site, ".mcap")
    traffic = None if how.traffic is None else traffic_of(how)
    server = None if how.serve is None else server_at(how.serve, progress)
    inputs = [site, obstructions, *([] if programme is None else [programme])]
    check_output(target, inputs=inputs)
    loaded = load_site(site, progress, programme=programme)
    insist_on_no_tandem(loaded.site)
    check_output(target, inputs=[*inputs, loaded.config.model.path])
    with workers_of(loaded.site, how.jobs) as workers:
        loaded, preparation = _prepared(target, loaded, progress, workers)
        chosen = policy_of(loaded, loaded.site, preparation, wish, progress)
        if traffic is not None:
            insist_on_one_crane(loaded.site)
        if how.speed is not None and not loaded.site.cranes:
            raise InputError("without a crane there is no motion to carry out", hint="leave --simulate out")
        clock = None if how.speed is None or traffic is not None else PlanClock(how.speed, started=how.clock_started)
        plan = WatchedPlan(loaded, chosen, target, seed_of(loaded, wish.seed))
        watcher = Watcher(plan, preparation, obstructions, progress, clock, workers)
        with workers.knowing(*constants_of(loaded.site, preparation)):
            if traffic is not None and how.speed is not None:
                yield from _among_others(watcher, preparation, traffic, how.speed)
                return
            watcher.retrain(how.retrain)
            if server is not None:
                server.advertise(len(loaded.site.cranes))
            viewers = () if server is None else (server,)
            yield from follow(watcher, once=how.once, poll_s=how.poll_s, stop=threading.Event(), viewers=viewers)


def _prepared(target: Path, loaded: LoadedSite, progress: Progress, workers: Workers) -> tuple[LoadedSite, Preparation]:
    """Return a site with the crane that lifts each part, and its preparation.

    With one crane, both follow from the site file. With several, they are those of the plan on disk, if there is one:
    lifts may have been handed over when they were timed.
    """
    found = read_newest(target, None, SilentProgress()) if loaded.site.names_cranes else None
    if found is not None and is_of(found.log.plan, loaded.site):
        site, preparation = with_cranes_of(loaded.site, found.log.plan.site), preparation_in(found.log.whole_plan)
    else:
        site, preparation = prepared(loaded.site, progress, workers, may_go_to_others(loaded))
    return replace(loaded, site=site), preparation


def _among_others(
    watcher: Watcher, preparation: Preparation, traffic: NamedTraffic, speed: float
) -> Iterator[dict[str, Any]]:
    """Make the plan or take it from the disk, then carry it out among people and vehicles; see ``watch``."""
    try:
        with interruptible():
            yield from watcher.take_up(state_of(watcher.file))
            yield from carry_out(watcher.whole_log(), preparation, traffic, speed, watcher.target, watcher.progress)
    except KeyboardInterrupt:
        watcher.told.note("stopped; the plan is complete")
    finally:
        watcher.close()


def follow(
    watcher: Watcher, *, once: bool, poll_s: float | None, stop: threading.Event, viewers: Sequence[Sink] = ()
) -> Iterator[dict[str, Any]]:
    """Make the first plan or continue from the one on disk, then revise it at every change; see ``watch``."""
    file, start = watcher.file, state_of(watcher.file)
    try:
        with interruptible():
            yield from watcher.take_up(start)
            if once:
                return
            watcher.warm()
            watcher.show_to(viewers)
            watcher.begin()
            watcher.progress.note(f"watching {file}")
            watcher.progress = SilentProgress()
            start = state_of(file, watcher.files) if watcher.files else start
            for state in changes(
                file, lambda: watcher.files, stop, start, poll_s=poll_s, again=watcher.wants_another_look
            ):
                yield from watcher.change(state)
    except KeyboardInterrupt:
        watcher.told.note("stopped; the last revision is complete")
    finally:
        watcher.close()
        for viewer in viewers if watcher.live is None else ():
            viewer.close()


class Watcher:
    """Holds the current plan and revises it.

    Args:
        plan: The watched plan, before its first revision.
        preparation: Contacts, order and yard of its site.
        file: The obstruction file.
        progress: Receives stages and notes.
        clock: The site's clock; None if the plan is not carried out.
        workers: Share the work; they know the site and its preparation.

    Attributes:
        file: The obstruction file.
        told: Receives notes for the user.
        progress: Receives the stages of a change.
        is_cold: Whether the first change would be slower than the others.
        live: Shows the plan to viewers; None if there are none.
    """

    def __init__(
        self,
        plan: WatchedPlan,
        preparation: Preparation,
        file: Path,
        progress: Progress,
        clock: PlanClock | None = None,
        workers: Workers = ALONE,
    ) -> None:
        self._plan, self._preparation, self._workers = plan, preparation, workers
        plan.is_carried_out = clock is not None
        self.file, self.progress, self.told = file, progress, progress
        self.live: LiveView | None = None
        self.is_cold = True
        self._reader = ObstructionReader(file, plan.loaded)
        self._reviser = Reviser(plan, preparation, clock, workers)
        self._whole = WholeLog(plan.target, progress)
        self._clock = clock
        self._execution = None if clock is None else Execution(clock)
        self._retraining: Retraining | None = None
        self._taken: str | None = None
        self._known_files: tuple[Path, ...] = ()
        self._driven_ns = 0

    @property
    def current(self) -> CurrentPlan | None:
        """The current plan; None before the first."""
        return self._plan.current

    @property
    def revision(self) -> int:
        """Number of the last revision."""
        return self._plan.revision

    @property
    def target(self) -> Path:
        """The log of the whole plan."""
        return self._plan.target

    def whole_log(self) -> PlanLog:
        """Return the log of the whole current plan."""
        return self._plan.whole_log()

    @property
    def files(self) -> tuple[Path, ...]:
        """The files that the obstruction file refers to."""
        return self._reader.files

    def take_up(self, state: FileState) -> Iterator[dict[str, Any]]:
        """Yield the document of the first plan: the one on disk if it fits the site, otherwise a new one."""
        self._taken = state.digest
        plan = self._plan
        self._reviser.propose = plan.policy.propose
        before = self._proven(read_newest(plan.target, plan.loaded.site.fixed_digest, self.progress))
        if before is not None:
            plan.take_up(before.log)
            if self._execution is not None:
                self._driven_ns = driven_until_ns(plan.target, plan.first)
                self._execution.clock.stand_at(max(plan.carried_out_ns, self._driven_ns))
            if not before.behind:
                keep_as_segment(plan.target, before.log.revision)
        if state.digest is None:
            self._reader.refused = "missing"
            if plan.current is not None and plan.current.plan.site.is_obstructed:
                yield self._missing(state)
                return
        try:
            site, content = self._reader.read(state, self.progress)
        except BimvoxError as error:
            if plan.current is None:
                raise
            yield self._refused("rejected", state.seen_s, error)
            return
        if plan.current is None:
            yield self._first_plan(site, content, state.seen_s)
        elif plan.current.plan.site.digest == site.digest and not plan.current.pending:
            yield plan.unchanged("unchanged", state.seen_s)
            if before is not None and (
                before.behind or not before.log.attachments.items() >= plan.loaded.files.items()
            ):
                self._whole.offer(plan.whole_log())
        else:
            yield from self._revise(Change(site, content, state.seen_s))

    def _proven(self, found: Newest | None) -> Newest | None:
        """Return the plan on disk if its proof passes; otherwise None, with a note. Pending lifts have no path yet."""
        if found is None:
            return None
        # A log says which site it is of; the plan is continued only if it holds that site.
        if with_digests(found.log.plan.site).fixed_digest != self._plan.loaded.site.fixed_digest:
            self.progress.note(f"{self._plan.target} is not used, the site in it is not that of its digest")
            return None
        if HELD_CRANES_FILE in found.log.attachments:
            # What held cranes have begun is in the file alone, so the plan is not whole.
            self.progress.note(f"{self._plan.target} is continued without a proof: its cranes are held")
            return found
        lifts = found.log.plan.lifts
        known = [lift.order for lift in lifts if lift.status is not Status.PLANNED or lift.path_vox is not None]
        verdict = prove_plan(found.log.extract(known), self.progress)
        if verdict.verified:
            self._reviser.known_shapes = set(range(len(lifts)))
            return found
        self.progress.note(f"{self._plan.target} is not used, its proof failed: {verdict.failures[0]}")
        return None

    def change(self, state: FileState) -> Iterator[dict[str, Any]]:
        """Yield what became of a changed file: the revisions of the plan, or why the last good plan remains."""
        self._whole.hold()
        gc.disable()  # a collection in the middle of a revision would cost 3 % of it
        try:
            yield from self._change(state)
            if self._retraining is not None and self._retraining.is_done:
                yield from self._retrained(state.seen_s)
        finally:
            gc.enable()
            self._whole.resume()

    def wants_another_look(self) -> bool:
        """Return whether there is work although the file has not changed: parts, training, simulation, a retry."""
        news = self._execution is not None and self._execution.has_news(self.current)
        trained = self._retraining is not None and self._retraining.is_done
        return self._plan.is_left_over or news or trained or self._reader.is_due

    def warm(self) -> None:
        """Make a warm-up revision: it loads compiled code and builds everything that is built once."""
        # A plan of several cranes is revised as a whole, which would take longer than it saves.
        if self.current is not None and not self.current.plan.site.has_several_cranes:
            reviser = self._reviser
            reviser.know(
                self._plan.loaded.site
            )  # a plan from disk has its own site object; its revisions have this one
            warm_up(self.current, self._preparation, reviser.propose, reviser.known_shapes, self._plan.segment)
            warm_workers(self.current.plan, self._preparation, self._workers)
        # Everything in memory now is permanent: the garbage collector need not scan it at every change.
        gc.collect()
        gc.freeze()
        self.is_cold = False

    def retrain(self, steps: int) -> None:
        """From now on, train the policy further in the background if it fails lifts; with 0 steps, do not."""
        if steps and self._plan.policy.propose is None:
            self.told.note("--retrain: there is no policy to train further; the paths found by search remain")
        elif steps:
            self._retraining = Retraining(self._preparation, self._plan.policy, self._plan.seed, steps)

    def show_to(self, viewers: Sequence[Sink]) -> None:
        """Show the plan to viewers; if it is carried out, also write the execution to a growing log."""
        sinks = list(viewers)
        if self._clock is not None:
            cranes = len(self._plan.loaded.site.cranes)
            sinks.append(DrivenLog(self._plan.target, self.told, cranes, self._plan.first))
        if sinks:
            self.live = LiveView(sinks, self._clock)

    def begin(self) -> None:
        """Start the execution, if there is one, where it ended last; show the plan."""
        if self._execution is not None:
            self._execution.clock.start(max(self._plan.carried_out_ns, self._driven_ns))
        self._show()

    def close(self) -> None:
        """End the training and the live view, and write the whole log if it is behind."""
        if self.live is not None:
            self.live.close()
        if self._retraining is not None:
            self._retraining.cancel()
        self._whole.close()

    def _change(self, state: FileState) -> Iterator[dict[str, Any]]:
        plan, reader = self._plan, self._reader
        if self._execution is not None:
            passed = self._execution.news(plan.current)
            if passed:
                self._show()
            for news in passed:
                yield news | {"revision": plan.revision, "log": str(plan.target)}
            same = state.digest == self._taken and self._taken is not None
            if same and not plan.is_left_over and not reader.waits:
                return
        elif self._retraining is not None and self._retraining.is_done and state.digest == self._taken:
            return
        self._taken = state.digest
        known, self._known_files = self._known_files, reader.files
        if state.digest is None:
            reader.forget()
            if reader.refused != "missing":
                yield self._missing(state)
            return
        try:
            site, content = reader.read(state, self.progress)
        except BimvoxError as error:
            if not reader.settles(state):
                return  # it was being written: the new content is read next
            if reader.refused != str(error):
                yield self._refused("rejected", state.seen_s, error)
            reader.try_again(state.seen_s)
            return
        current = plan.current
        if current is not None and current.plan.site.digest == site.digest and not plan.is_left_over:
            reader.accept()
            if known == reader.files:  # otherwise only the list of watched files has changed
                yield plan.unchanged("unchanged", state.seen_s, notes=notes_about(site))
            return
        yield from self._revise(Change(site, content, state.seen_s))

    def _first_plan(self, site: Site, content: dict[str, bytes], started_s: float) -> dict[str, Any]:
        plan = self._plan
        planned = plan_and_prove(
            site,
            self._preparation,
            plan.policy,
            progress=self.progress,
            workers=self._workers,
            may_hand_over=may_go_to_others(plan.loaded),
        )
        if planned.preparation is not None:
            plan.loaded = replace(plan.loaded, site=with_cranes_of(plan.loaded.site, planned.plan.site))
            self._preparation = self._reviser.preparation = planned.preparation
            self._reader.now_of(plan.loaded)
        self._reviser.known_shapes = set(range(len(site.components)))
        segment = segment_file(plan.target, plan.revision + 1)
        record = plan.first_log(planned, content)
        write_log_file(segment, record, self._workers)
        write_atomically(plan.target, segment.read_bytes())
        plan.revision, plan.content = plan.revision + 1, content
        plan.current = current_plan_of(planned.plan, planned.motions)
        document = plan.document("planned", planned.plan, None, started_s)
        more = {"blocked": infeasible_lifts(planned.plan, planned.motions), "remarks": counts_of(record.remarks or ())}
        return document | {"segment": str(segment), **more}

    def _retrained(self, started_s: float) -> Iterator[dict[str, Any]]:
        """Revise the plan with a retrained policy, for the lifts on which it was trained."""
        assert self._retraining is not None
        assert self.current is not None
        components = frozenset(self._retraining.components)
        try:
            found = self._retraining.result()
        except PolicyError as error:
            yield self._refused("failed", started_s, error)
            return
        if found is None or found.network is None:
            message = "no retrained policy was better: the paths found by search remain"
            yield self._plan.unchanged("retrained", started_s, message)
            return
        better = RetrainedPolicy(components, proposer(found.network, every_guard=True))
        yield from self._revise(Change(self.current.plan.site, self._plan.content, started_s, better, found.id))

    def _revise(self, change: Change) -> Iterator[dict[str, Any]]:
        """Revise the plan, and yield the document of each part once it is on disk."""
        if self._retraining is not None:
            self._retraining.cancel()
        searched: set[int] = set()
        revised = self._reviser.revise(change)
        try:
            for one in revised:
                self._reader.accept()
                searched |= left_to_search(one.part)
                # The whole log of several cranes is not written while they are held.
                held = one.part.current.held is not None
                if not one.part.current.pending and not (held and change.site.has_several_cranes):
                    self._whole.offer(self._plan.whole_log())
                    if self._retraining is not None and change.better is None:
                        self._retraining.begin(change.site, searched)
                self._show(revision_events(one.part, one.document, self._plan.carried_out_ns))
                yield one.document
                if held:
                    return  # it waits for a change
                if one.part.current.pending and self._reader.holds_other_than(self._plan.content):
                    return  # the next change includes the pending lifts
        except BimvoxError as error:
            if self._reader.refused != str(error):
                yield self._refused("failed", change.started_s, error)
            if isinstance(error, FileError):
                self._reader.try_again(change.started_s)
        finally:
            revised.close()

    def _show(self, events: tuple[LogEvent, ...] = ()) -> None:
        """Show the current plan and its events to viewers."""
        if self.live is not None and (now := self.current) is not None:
            motions = tuple(now.on_the_clock[order] for order in sorted(now.on_the_clock))
            self.live.show(PlanLog(now.plan, motions, revision=self.revision, events=events), now.held_loads)

    def _missing(self, state: FileState) -> dict[str, Any]:
        self._reader.refused = "missing"
        why = f"{self._reader.why_missing() or f'{self.file} does not exist'}; the last good plan stands"
        return self._plan.unchanged("missing", state.seen_s, f"{why}, with its obstructions")

    def _refused(self, event: str, started_s: float, error: BimvoxError) -> dict[str, Any]:
        self._reader.refused = str(error)
        return self._plan.unchanged(event, started_s, str(error))
