"""``bimvox plan``: every lift planned, proven, timed, and written to the log."""

from __future__ import annotations

from collections.abc import Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, BinaryIO, Self, cast

from bimvox.crane.machine import identity
from bimvox.files import check_output, default_output, put_in_place, written_aside
from bimvox.library.arguments import PolicyWish
from bimvox.library.plan import planned
from bimvox.library.prove import Planned
from bimvox.library.site import load_site, read_obstructions
from bimvox.log.plan_log import PlanLog, log_calendar, log_costs, log_times, with_full_rate
from bimvox.log.recorder import write_log
from bimvox.motion.figures import CraneFigures, PlanFigures, plan_figures
from bimvox.motion.steps import steps_of
from bimvox.planning.stage import refused_by_crane
from bimvox.policy.choice import PolicyInUse
from bimvox.progress import Progress
from bimvox.records.lift import Lift, LiftPlan, infeasible_among
from bimvox.records.motion import LiftMotion
from bimvox.records.plan_dates import PlanDates
from bimvox.records.steps import needed_by_ns, not_lifted_groups, set_up_documents
from bimvox.records.unloading import deliveries_of
from bimvox.remarks.proven_props import proven_props
from bimvox.rendering.page.lifts import FLIP, TANDEM, governing
from bimvox.site.config.calendar import CalendarConfig, CostsConfig
from bimvox.site.site import Site, names_by_id
from bimvox.workers import Workers
from bimvox_pipeline.watch.log import segments_on_disk


def plan(
    site: Path,
    out: Path | None = None,
    *,
    obstructions: Path | None = None,
    programme: Path | None = None,
    wish: PolicyWish = PolicyWish(),  # noqa: B008  (immutable)
    jobs: int | None = None,
    full_rate: bool = False,
    progress: Progress,
) -> dict[str, Any]:
    """Plan a site file with :func:`bimvox.plan`, write the log, and return the document of ``bimvox plan --json``.

    ``out`` is the log; default: the site's name with ``.mcap``, in the current folder. ``programme`` takes the place of
    the one that the site file names. ``full_rate`` is that of :func:`bimvox.write_log`, the other arguments
    are those of :func:`bimvox.plan`, five of them in ``wish``.

    Raises:
        NoPlanError: If no lift can be planned; nothing is written.
        VerificationError: If a proof fails; nothing is written.
    """
    target = out or default_output(site, ".mcap")
    inputs = [site, *(file for file in (obstructions, programme) if file is not None)]
    check_output(target, inputs=inputs)
    given = None if obstructions is None else read_obstructions(obstructions)  # before the site, which takes its time
    loaded = load_site(site, progress, programme=programme)
    check_output(target, inputs=[*inputs, loaded.config.model.path])
    with (
        LogAhead(target, inputs=inputs, full_rate=full_rate) as log,
        planned(loaded, wish, obstructions=given, jobs=jobs, progress=progress, timed=log.begin) as (made, workers),
    ):
        progress.stage("write")
        log.finish(made.record, workers)
        progress.finish()
    assert made.policy is not None
    more: dict[str, Any] = {"retrained": made.retrained.to_dict()} if made.retrained is not None else {}
    calendar, costs, times = log_calendar(made.record), log_costs(made.record), log_times(made.record)
    document = _document_of(Planned(made.record.plan, made.motions), made.policy, calendar, costs, times)
    more |= {"calendar": times.document() if times and times.is_dated else None}
    more |= {"remarks": [remark.to_dict() for remark in made.remarks]}
    more |= {"not_covered": [line.to_dict() for line in made.not_covered]}
    return {**document, **more, "log": str(target), "seconds": progress.seconds}


def _document_of(
    proven: Planned, policy: PolicyInUse, calendar: CalendarConfig, costs: CostsConfig, times: PlanDates | None
) -> dict[str, Any]:
    """Return the document of ``bimvox plan --json`` for a proven plan."""
    site = proven.plan.site
    motions = {motion.order: motion for motion in proven.motions}
    steps = steps_of(site, proven.plan.lifts, proven.motions)
    lifts = []
    for lift in proven.plan.lifts:
        component, motion = site.components[lift.component], motions.get(lift.order)
        lifts.append(
            {
                "component": component.id,
                "global_id": component.global_id,
                "ifc_class": component.ifc_class,
                "name": component.name,
                "order": lift.order,
                "number": lift.number,
                "method": lift.method.value if lift.method else None,
                "moves": lift.moves,
                "shortest_moves": lift.shortest_moves,
                "contact_moves": lift.contact_moves if lift.path_vox is not None else None,
                "duration_s": round(motion.loaded.duration_s, 3) if motion else None,
                "bound_s": round(motion.loaded.bound_s, 3) if motion else None,
                "start_s": round(motion.start_ns / 1e9, 3) if motion else None,
                "end_s": round(motion.end_ns / 1e9, 3) if motion else None,
                "elapsed_start_s": round(steps.starting_ns(motion.start_ns) / 1e9, 3) if motion else None,
                "elapsed_end_s": round(steps.ending_ns(motion.end_ns) / 1e9, 3) if motion else None,
                "status": lift.status.value,
                "kind": component.judgement.kind.value,
                "kind_from": component.judgement.why,
                "confidence": component.judgement.confidence.value,
                "mass_kg": round(component.mass_kg, 1),
                "mass_from": component.mass_source,
                "storey": component.storey,
                **_seen(site, motion),
                **_when(times, lift.order),
                **({"with_jib": True} if lift.with_jib else {}),
                **({"flip": FLIP.of(lift.flip)} if lift.flip else {}),
                **({"tandem": _together(site, lift)} if lift.tandem else {}),
                **({"planner": lift.planner} if lift.planner else {}),
                **({"planner_note": lift.planner_note} if lift.planner_note else {}),
                **({"crane": site.cranes[component.crane].name} if site.names_cranes else {}),
            }
        )
    return {
        "verified": True,
        "cranes": [identity(crane) for crane in site.cranes],
        "policy": policy.to_dict(),
        "figures": figures_document(plan_figures(proven.plan, proven.motions, calendar, steps, costs))
        | {"elapsed_hours": round(steps.elapsed_ns(proven.motions) / 3.6e12, 6) if motions else None},
        "lifts": lifts,
        "infeasible": infeasible_lifts(proven.plan, proven.motions, times),
        "not_lifted": [
            times.with_dates(one) if times else one.to_dict()
            for one in not_lifted_groups(site, proven.plan.lifts, proven.motions, steps)
        ],
        "time": times.time if times else None,
        "deliveries": _deliveries(proven.plan, times) if times else [],
        **set_up_documents(site, proven.motions, steps),
        **steps.documents(site),
        **proven_props(proven.plan, tuple(proven.motions)).documents(site),
        "clashes": [
            {"first": c.first, "second": c.second, "depth_m": round(c.depth_m, 4), "at_least": c.at_least}
            for c in proven.plan.clashes
        ],
        "notes": [*proven.plan.site.notes, *proven.plan.notes],
    }


def _together(site: Site, lift: Lift) -> dict[str, Any]:
    """Return the share of each of the two cranes that carry a part, with their names."""
    assert lift.tandem is not None
    return TANDEM.of(lift.tandem) | {"names": [site.cranes[number].name for number in lift.tandem.cranes]}


def _seen(site: Site, motion: LiftMotion | None) -> dict[str, Any]:
    """Return what governs a lift: the load on the hook, the gross capacity of the chart there, and the wind."""
    if motion is None:
        return {}
    governs, wind = governing(site, motion), motion.least_wind
    return {
        "radius_m": round(governs["radius_m"], 3),
        "load_kg": round(governs["load_kg"], 1),
        "gross_capacity_kg": round(governs["capacity_kg"], 1),
        "utilisation": None if governs["utilisation"] is None else round(governs["utilisation"], 6),
        "permitted_wind_m_s": None if wind is None else round(wind.speed_m_s, 3),
    }


def _when(times: PlanDates | None, order: int) -> dict[str, str]:
    words = times and times.span_in_words(order)
    return dict(zip(("begins_in_words", "ends_in_words"), words, strict=True)) if words else {}


def _deliveries(plan: LiftPlan, times: PlanDates) -> list[dict[str, Any]]:
    """Return the deliveries: their parts, lorries and mass, and when they come and are unloaded."""
    found = []
    for number, lifts in sorted(deliveries_of(plan.lifts).items()):
        at, span = times.lorries.get(number, ()), times.deliveries.get(number)
        found.append(
            {
                "number": number + 1,
                "lifts": [lift.number for lift in lifts],
                "parts": len(lifts),
                "lorries": len(at) or None,
                "mass_kg": round(sum(plan.site.components[lift.component].mass_kg for lift in lifts), 1),
                "arrives_in_words": span and times.in_words(times.moment(span[0])),
                "unloaded_in_words": span and times.in_words(times.moment(span[1])),
            }
        )
    return found


def infeasible_lifts(
    plan: LiftPlan, motions: Iterable[LiftMotion], times: PlanDates | None = None
) -> list[dict[str, Any]]:
    """Return the infeasible lifts of a plan, each with its reason and blockers, for the JSON documents.

    A part is carried if the crane lifts it by reach, load chart, gear and wind, which is what `init` says of a crane.
    Those whose parts are set by other means have the time by which each is needed.
    """
    components, needed_ns = plan.site.components, needed_by_ns(plan.lifts, motions)
    names = names_by_id(plan.site)
    return [
        {
            "number": lift.number,
            "component": components[lift.component].id,
            "global_id": components[lift.component].global_id,
            "name": components[lift.component].name,
            "reason": lift.reason,
            "blocked_by": list(lift.blocked_by),
            "blocked_by_names": [names.get(blocker, blocker) for blocker in lift.blocked_by],
            "is_carried": refused_by_crane(plan.site, components[lift.component]) is None,
            "by_other_means": lift.by_other_means,
            "needed_by_s": None if (at_ns := needed_ns.get(lift.order)) is None else round(at_ns / 1e9, 3),
            **({"needed_by_in_words": times.clock_in_words(at_ns)} if times else {}),
        }
        for lift in infeasible_among(plan.lifts)
    ]


def figures_document(figures: PlanFigures) -> dict[str, Any]:
    """Return the figures of a plan for the JSON documents; those that need a crane are None without one."""
    ratio, travel = figures.length_ratio, figures.hook_travel_m
    return {
        "planned": figures.planned,
        "shares": {method: round(figures.share(method), 6) for method in figures.methods},
        "moves": figures.moves,
        "shortest_moves": figures.shortest_moves,
        "moves_over_shortest": None if ratio is None else round(ratio, 6),
        "crane_hours": None if figures.crane_s is None else round(figures.crane_s / 3600.0, 6),
        "unloading_hours": None if figures.unloading is None else round(figures.unloading.seconds / 3600.0, 6),
        "hook_hours": None if figures.hook_s is None else round(figures.hook_s / 3600.0, 6),
        "unloading": None if figures.unloading is None else asdict(figures.unloading),
        **({"move_hours": round(figures.moves_s / 3600.0, 6)} if figures.moves_s else {}),
        "hire_days": figures.hire_days,
        **({} if figures.cost is None else {"cost": figures.cost.document()}),
        "loaded_hours": None if figures.loaded_s is None else round(figures.loaded_s / 3600.0, 6),
        "hook_travel_m": None if travel is None else round(travel, 3),
        "critical_lifts": figures.critical,
        "critical_share": figures.critical_share,
        "highest_utilisation": figures.highest,
        "swing": None if figures.swing is None else figures.swing.value,
        "permitted_wind": None if figures.wind is None else asdict(figures.wind),
        **({"cranes": [_crane_document(crane) for crane in figures.cranes]} if figures.cranes else {}),
    }


def _crane_document(crane: CraneFigures) -> dict[str, Any]:
    return {
        "name": crane.name,
        "lifts": crane.lifts,
        "busy_hours": round(crane.busy_s / 3600.0, 6),
        "busy_share": round(crane.share, 6),
    }


# A log that is written beside its file while its plan is being proven, and put in its place once it is.


class LogAhead:
    """Writes the log of a plan; leaving the block removes what was begun in vain.

    Next to revisions of a watch it is a later revision than all of them: otherwise they would replace it.

    ``inputs`` are files that it must not replace; ``full_rate`` is that of :func:`bimvox.write_log`.
    """

    def __init__(self, path: Path, *, inputs: Iterable[Path] = (), full_rate: bool = False) -> None:
        self._path, self._inputs, self._full_rate = path, tuple(inputs), full_rate
        self._thread = ThreadPoolExecutor(1, "log")
        self._begun: tuple[PlanLog, _Target, Future[Path]] | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._give_up()
        self._thread.shutdown()

    def begin(self, record: PlanLog, workers: Workers) -> None:
        """Begin to write the log of a plan that is still to be proven, if there are processes to share the work."""
        self._give_up()
        if workers.count > 1:
            target = _Target()
            with suppress(RuntimeError):  # the system gives no further thread
                self._begun = record, target, self._thread.submit(self._written, record, workers, target)

    def finish(self, record: PlanLog, workers: Workers) -> None:
        """Put the log of a proven plan in its place.

        Raises:
            FileError: If it cannot be written.
        """
        check_output(self._path, inputs=self._inputs)
        if self._begun is not None and self._begun[0] is record:
            written = self._begun[2].result()
        else:
            written = self._written(record, workers, _Target())
        put_in_place(written, self._path)

    def _written(self, record: PlanLog, workers: Workers, target: _Target) -> Path:
        record = with_full_rate(record) if self._full_rate else record
        with suppress(OSError):  # a folder that can be written to may not be listed
            record = replace(record, revision=1 + max(segments_on_disk(self._path), default=record.revision - 1))
        return written_aside(self._path, lambda stream: write_log(target.on(stream), record, workers=workers))

    def _give_up(self) -> None:
        """End what was begun; its file does not remain."""
        if self._begun is None:
            return
        (_, target, future), self._begun = self._begun, None
        target.is_wanted = False
        with suppress(Exception):
            future.result().unlink(missing_ok=True)


class _GivenUpError(Exception):
    """The file is not wanted any more."""


class _Target:
    """A stream that fails once it is not wanted any more."""

    is_wanted = True

    def on(self, stream: BinaryIO) -> BinaryIO:
        """Return this, writing to a stream."""
        self._stream, self.tell = stream, stream.tell
        return cast(BinaryIO, self)

    def write(self, data: bytes) -> int:
        """Write to the stream."""
        if not self.is_wanted:
            raise _GivenUpError
        return self._stream.write(data)
