"""The lift plan record as plain values: the source of every number in the report."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.carrier import Carrier
from bimvox.crane.load_chart import LoadChart
from bimvox.crane.machine import identity
from bimvox.crane.outline import outline_of
from bimvox.crane.tower_crane import AxisLimits, TowerCrane
from bimvox.grid.frame import Label
from bimvox.motion.figures import driven_rates, hook_travel_m, plan_figures
from bimvox.records.lift import Lift, Status
from bimvox.records.motion import LiftMotion, PhaseName, by_each_crane
from bimvox.records.plan_dates import PlanDates
from bimvox.records.steps import Steps, not_lifted_groups, set_up_documents
from bimvox.remarks.cranes import least_height_m
from bimvox.remarks.subject import Subject
from bimvox.rendering.page.lifts import is_critical, lift_record, proof_record
from bimvox.rendering.page.source import Revision
from bimvox.rendering.report.distances import distances_of
from bimvox.rendering.report.props import propped
from bimvox.rendering.report.rigging import gear_list, rigs_of
from bimvox.rendering.report.risks import with_categories
from bimvox.rendering.report.site_plan import drawing_of
from bimvox.rendering.report.support import out_of_service, supports_of, survey_of
from bimvox.site.catalogue import machine_called
from bimvox.site.config.project import ProjectConfig
from bimvox.site.site import Site
from bimvox.site.tandem import cranes_of
from bimvox.site.work import work_of

FORMAT = 1
_RULES = (
    *("clearance_m", "transit_clearance_m", "rope_clearance_m", "departure_clearance_m", "approach_clearance_m"),
    *("upending_clearance_m", "turning_clearance_m", "gives_way", "contact_tolerance_m", "support_gap_m"),
    *("rope", "sample_period_s", "swing", "wind_speed_m_s", "least_wind_m_s", "drag_coefficient", "sling_angle_rad"),
    "highest_utilisation",
    "upend_s",
)
CARRYING = frozenset((PhaseName.HOIST, PhaseName.TRAVERSE, PhaseName.LOWER))
"""Phases in which the load is in transit."""

_VALUES = ("policy", "policy_steps", "seed", "bimvox", "schema_version")
"""Metadata about how the plan was made, other than files."""


def record_of(revision: Revision, *, critical_share: float | None = None) -> dict[str, Any]:
    """Return the record of a plan, as JSON values.

    ``critical_share``: share of the capacity from which a lift is critical, 0..1; None takes the site's rules.

    Returns:
        ``log, project, site, crane, drawing, distances, method, support, out_of_service, survey, blind, rigs, gear,
        totals, methods, lifts, critical, infeasible, steps, pauses, props, not_lifted, deliveries, verdict, conditions,
        not_covered, proof, remarks, inputs, clashes, notes``. ``critical`` are orders of lifts, the highest
        utilisation first; ``infeasible`` orders of lifts, causes first: those blocked only by other infeasible ones
        come last.
    """
    site = revision.plan.site
    if critical_share is None:
        critical_share = site.rules.critical_share
    motions = {motion.order: motion for motion in revision.motions}
    steps = revision.steps
    lifts = [_lift(revision, lift, motions.get(lift.order), critical_share) for lift in revision.lifts]
    rigs = rigs_of(lifts)
    names = {order: rig["name"] for rig in rigs for order in rig["orders"]}
    lifts = [lift | {"rig": names.get(lift["order"])} for lift in lifts]
    drawing = drawing_of(revision)
    # What the site file in the log states about project and people; None for what it does not state.
    project = (revision.config and revision.config.project) or ProjectConfig()
    lowest = least_height_m(Subject(revision.plan, tuple(revision.motions), tuple(revision.context)))
    critical = sorted((lift for lift in lifts if lift["critical"]), key=_most_used)
    method, blind, remarks = method_of(revision), blind_lifts(revision), [one.to_dict() for one in revision.remarks]
    supports = supports_of(revision)
    pads = {one["order"]: one for support in supports if support["pads"] for one in support["pads"]["lifts"]}
    lifts = with_categories([lift | pads.get(lift["order"], {}) for lift in lifts], remarks, blind, method)
    return {
        "format": FORMAT,
        "log": {
            "name": revision.log,
            "sha256": revision.sha256,
            "revision": revision.number,
            "extract": bool(revision.context),
            "recovered": revision.metadata.get("recovered") == "true",
        },
        "project": {**project.model_dump(mode="json"), "issue": project.issue},
        "site": _site(site) | {"least_height": lowest and dict(zip(("height_m", "part", "over"), lowest, strict=True))},
        "crane": _crane(revision, 0) if site.cranes else None,
        **({"other_cranes": [_crane(revision, n) for n in others]} if (others := range(1, len(site.cranes))) else {}),
        "drawing": drawing,
        "distances": distances_of(revision),
        "method": method,
        "blind": blind,
        "support": supports,
        "out_of_service": out_of_service(revision),
        "survey": survey_of(revision, drawing["areas"]),
        "rigs": rigs,
        "gear": gear_list(rigs),
        "totals": _totals(revision, lifts) | _of_cranes(site, lifts),
        "methods": _methods(lifts),
        "critical_share": critical_share,
        "lifts": lifts,
        "structures": {blocker.id: blocker.name for blocker in site.blockers if blocker.name},
        "critical": [lift["order"] for lift in critical],
        "infeasible": _causes_first(lifts),
        **set_up_documents(site, revision.motions, steps),
        **steps.documents(site),
        "props": propped(revision),
        "not_lifted": [
            revision.times.with_dates(one) if revision.times else one.to_dict()
            for one in not_lifted_groups(site, revision.lifts, revision.motions, steps)
        ],
        "deliveries": _deliveries(lifts, revision.times),
        "verdict": revision.verdict.to_dict(),
        "conditions": list(revision.conditions),
        "not_covered": [line.to_dict() for line in revision.not_covered],
        "proof": proof_record(revision),
        "remarks": remarks,
        "inputs": _inputs_of(revision),
        "clashes": [_values(clash, "first", "second", "depth_m", "at_least") for clash in revision.plan.clashes],
        "notes": [
            *(revision.dates.notes if revision.dates else ()),
            *site.notes,
            *site.obstruction_notes,
            *revision.plan.notes,
        ],
    }


def _lift(revision: Revision, lift: Lift, motion: LiftMotion | None, critical_share: float) -> dict[str, Any]:
    component = revision.plan.site.components[lift.component]
    track = next((track for track in revision.tracks if track.lift.order == lift.order), None)
    record = lift_record(revision, lift)
    return {
        **record,
        **({"crane": component.crane} if revision.plan.site.names_cranes else {}),
        **_values(component, "id", "global_id", "name", "ifc_class"),
        "stack": 0 if lift.place is None else lift.place.stack,
        "rack": 0 if lift.place is None else abs(lift.place.rack),
        **_values(component, "storey", "mass_kg", "mass_source"),
        "critical": is_critical(record, critical_share),
        "begins_at": revision.dates.span(lift.order)[0] if revision.dates else None,
        **_in_words(revision.times, record, lift.order),
        "begins_s": track.start_ns / 1e9 if track else None,
        "ends_s": track.end_ns / 1e9 if track else None,
        "hook_travel_m": hook_travel_m(revision.plan.site, motion) if motion else None,
        "phases": [[p.name.value, p.start_ns / 1e9, p.end_ns / 1e9] for p in motion.phases] if motion else [],
    }


def _in_words(times: PlanDates | None, record: dict[str, Any], order: int) -> dict[str, Any]:
    """Return when a lift begins, ends and is needed, and when its governing sample is, in words."""
    begins, ends = (times and times.span_in_words(order)) or (None, None)
    seconds = {"needed_by_in_words": record["needed_by_s"], "governs_in_words": (record["governs"] or {}).get("time_s")}
    clocks = {
        key: None if times is None or at_s is None else times.clock_in_words(round(at_s * 1e9))
        for key, at_s in seconds.items()
    }
    return {"begins_in_words": begins, "ends_in_words": ends, **clocks}


def _causes_first(lifts: list[dict[str, Any]]) -> list[int]:
    bad = [lift for lift in lifts if lift["status"] == Status.INFEASIBLE.value]
    ids = {lift["id"] for lift in bad}
    follow = {lift["order"] for lift in bad if lift["blocked_by"] and ids.issuperset(lift["blocked_by"])}
    return sorted((lift["order"] for lift in bad), key=lambda order: (order in follow, order))


def _most_used(lift: dict[str, Any]) -> tuple[float, int]:
    used = lift["governs"]["utilisation"]
    return (-np.inf if used is None else -used, lift["order"])


def _site(site: Site) -> dict[str, Any]:
    size_m = site.frame.voxel_size_m
    return {
        "name": site.name,
        "model": str(site.source.get("name", "")),
        "shape": list(site.shape),
        "extent_m": [round(n * size_m, 6) for n in site.shape],
        "voxel_size_m": size_m,
        "origin_m": list(site.frame.origin_m),
        "yard_m2": float(np.count_nonzero(site.yard)) * size_m**2,
        "obstructions": [blocker.id for blocker in site.blockers if blocker.kind == "obstruction"],
        "structure": sum(blocker.kind == "structure" for blocker in site.blockers),
        "no_load_m2": 0.0 if site.no_load is None else float(np.count_nonzero(site.no_load)) * size_m**2,
        "prohibited_m2": 0.0 if site.prohibited is None else float(np.count_nonzero(site.prohibited)) * size_m**2,
        "rules": _values(site.rules, *_RULES),
    }


def _crane(revision: Revision, number: int) -> dict[str, Any]:
    crane = revision.plan.site.cranes[number]
    named = machine_called(crane.machine or crane.name)
    return {
        **identity(crane),
        "kind": crane.kind,
        "about": None if named is None else named.about,  # None if it is not a machine of the catalogue
        "luffing": crane.luffing and _values(crane.luffing, *_JIB),
        "base_m": list(crane.base_m),
        **_values(crane, "jib_height_m", "min_radius_m", "sling_m", "rigging_mass_kg", "hook_block_kg"),
        "gears": [list(gear) for gear in crane.gears],
        "max_wind_m_s": crane.max_wind_m_s,
        "working_range": _values(crane.working_range, "slew_rad", "radius_m", "highest_hook_m"),
        "slow_zones": [zone.share for zone in crane.slow_zones],
        **_values(crane, "slewing", "trolley", "hoist"),
        "driven": driven_rates([one for one in by_each_crane(revision.motions) if one.crane == number]),
        "chart": _chart(crane.chart),
        "carrier": crane.carrier and _carrier(crane.carrier),
    }


def _chart(chart: LoadChart) -> list[list[float]]:
    return [list(pair) for pair in zip(chart.radius_m, chart.capacity_kg, strict=True)]


def _carrier(carrier: Carrier) -> dict[str, Any]:
    """Return how a mobile crane is set up, with its charts by sector (null: no load may hang there)."""
    base = carrier.outriggers
    return {
        "heading_rad": carrier.heading_rad,
        "counterweight_kg": carrier.counterweight_kg,
        "outriggers": base and _values(base, "name", "front_m", "rear_m", "left_m", "right_m"),
        "rating": carrier.rating,
        "deductions": [list(one) for one in carrier.deductions],
        "sectors": [
            _values(one, "name", "from_rad", "to_rad") | {"chart": None if one.chart is None else _chart(one.chart)}
            for one in carrier.sectors
        ],
    }


_JIB = ("length_m", "pivot_height_m", "luff_rad", "limits", "winch", "tail_radius_m")


def _values(of: object, *names: str) -> dict[str, Any]:
    """Return attributes as plain values: limits of an axis as a document, tuples as lists."""

    def plain(value: Any) -> Any:
        if isinstance(value, AxisLimits):
            return _values(value, "rate", "acceleration", "jerk")
        return list(value) if isinstance(value, tuple) else value

    return {name: plain(getattr(of, name)) for name in names}


def _totals(revision: Revision, lifts: list[dict[str, Any]]) -> dict[str, Any]:
    planned = [lift for lift in lifts if lift["status"] == Status.PLANNED.value]
    begins = [lift["begins_s"] for lift in planned if lift["begins_s"] is not None]
    ends = [lift["ends_s"] for lift in planned if lift["ends_s"] is not None]
    used = [lift["governs"]["utilisation"] for lift in planned if lift["governs"]]
    carried = [end - start for lift in lifts for name, start, end in lift["phases"] if name in CARRYING]
    return {
        "lifts": len(lifts),
        "planned": len(planned),
        "infeasible": revision.infeasible,
        "carried": len(revision.plan.lifts),
        "critical": sum(lift["critical"] for lift in lifts),
        "proven": sum(lift["proven"] is True for lift in lifts),
        "timed_by": "crane" if revision.motions else "nominal",
        "total_s": max(ends) - min(begins) if begins else 0.0,
        "time": revision.times.time if revision.times else None,
        "calendar": revision.dates.document() if revision.dates else None,
        "elapsed_s": revision.steps.elapsed_ns(revision.motions) / 1e9 if revision.steps != Steps() else None,
        "paused_s": revision.steps.paused_ns / 1e9,
        "cost": _cost(revision),
        "carrying_s": sum(carried),
        "hook_travel_m": sum(lift["hook_travel_m"] or 0.0 for lift in lifts) if revision.motions else None,
        "mass_kg": sum(lift["mass_kg"] for lift in planned),
        "heaviest_kg": max((lift["mass_kg"] for lift in planned), default=0.0),
        "highest_utilisation": max((u for u in used if u is not None), default=None),
        "moves": sum(lift["moves"] or 0 for lift in planned),
        "shortest_moves": sum(lift["shortest_moves"] or 0 for lift in planned if lift["moves"] is not None),
        "compared_moves": sum(lift["moves"] or 0 for lift in planned if lift["shortest_moves"] is not None),
    }


def _cost(revision: Revision) -> dict[str, Any] | None:
    """Return what the work costs, and for how many days the crane is hired; None of an extract, or without rates."""
    if revision.config is None or revision.context:
        return None
    calendar, costs = revision.config.calendar, revision.config.costs
    found = plan_figures(revision.plan, revision.motions, calendar, revision.steps, costs)
    return None if found.cost is None else {**found.cost.document(), "hire_days": found.hire_days}


def _of_cranes(site: Site, lifts: list[dict[str, Any]]) -> dict[str, Any]:
    """Return lifts, working time and waiting time of each of several cranes."""
    if not site.has_several_cranes:
        return {}
    found = []
    for number, crane in enumerate(site.cranes):
        phases = [phase for lift in lifts if lift["crane"] == number for phase in lift["phases"]]
        found.append(
            {
                "name": crane.name,
                "lifts": sum(lift["crane"] == number and lift["begins_s"] is not None for lift in lifts),
                "works_s": sum(end - start for name, start, end in phases if name != PhaseName.WAIT),
                "waits_s": sum(end - start for name, start, end in phases if name == PhaseName.WAIT),
            }
        )
    return {"cranes": found}


def _methods(lifts: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the shares of the planned lifts by method, the largest first."""
    found = Counter(lift["method"] for lift in lifts if lift["method"])
    return [
        {"method": method, "lifts": count, "share": count / found.total()}
        for method, count in sorted(found.items(), key=lambda item: (-item[1], item[0]))
    ]


def _deliveries(lifts: list[dict[str, Any]], dates: PlanDates | None) -> list[dict[str, Any]]:
    """Return the deliveries to the yard, each with its lifts, its stacks, and when it arrives, if times are known."""
    arrivals = {} if dates is None else dates.deliveries
    groups: dict[int, list[dict[str, Any]]] = {}
    for lift in lifts:
        if lift["delivery"] is not None and lift["status"] == Status.PLANNED.value:
            groups.setdefault(lift["delivery"], []).append(lift)
    return [
        {
            "delivery": number,
            "orders": [lift["order"] for lift in group],
            "mass_kg": sum(lift["mass_kg"] for lift in group),
            "begins_s": group[0]["begins_s"],
            "ends_s": group[-1]["ends_s"],
            "stacks": len({lift["stack"] for lift in group} - {0}),
            "racks": len({lift["rack"] for lift in group} - {0}),
            "begins_in_words": group[0]["begins_in_words"],
            "ends_in_words": group[-1]["ends_in_words"],
            "arrives": dates.in_words(dates.moment(arrivals[number][0])) if dates and number in arrivals else None,
        }
        for number, group in sorted(groups.items())
    ]


def _inputs_of(revision: Revision) -> list[dict[str, str]]:
    """Return all inputs of the plan with their hashes, in order of use."""
    site, metadata = revision.plan.site, revision.metadata
    rows = [("log", revision.log, revision.sha256)]
    if site.source.get("sha256"):
        rows.append(("model", str(site.source.get("name", "")), str(site.source["sha256"])))
    prefix = "sha256 "
    rows += [("file", key.removeprefix(prefix), metadata[key]) for key in sorted(metadata) if key.startswith(prefix)]
    rows.append(("digest", "grid, part shapes and crane", site.geometry_digest))
    rows.append(("digest", "site without obstructions", site.fixed_digest))
    rows.append(("digest", "site with obstructions", site.digest))
    rows += [("value", key.replace("_", " "), metadata[key]) for key in _VALUES if key in metadata]
    return [{"kind": kind, "name": name, "value": value} for kind, name, value in rows if value]


# The method statement as plain values: how each class of parts is lifted, and which lifts the operator cannot see.


def method_of(revision: Revision) -> list[dict[str, Any]]:
    """Return how the planned lifts of each class of work are carried out, in the order of their first lifts.

    Each has ``work, lifts`` (numbers), ``heaviest_kg``, ``upended`` and ``turned`` (how many are), ``points`` (fewest
    and most lifting points) and ``phases`` (shortest and longest time of each, seconds).
    """
    motions = {motion.order: motion for motion in revision.motions}
    groups: dict[str, list[Lift]] = {}
    for lift in revision.lifts:
        if lift.status is Status.PLANNED:
            work = work_of(revision.plan.site.components[lift.component]).value
            groups.setdefault(work, []).append(lift)
    return [_class(revision.plan.site, work, group, motions) for work, group in groups.items()]


def _class(site: Site, work: str, lifts: list[Lift], motions: dict[int, LiftMotion]) -> dict[str, Any]:
    parts = [site.components[lift.component] for lift in lifts]
    points = [len(part.lifting.points_m) for part in parts]
    spans: dict[str, list[float]] = {}
    for motion in (motions[lift.order] for lift in lifts if lift.order in motions):
        own: dict[str, float] = {}
        for phase in motion.phases:
            own[phase.name.value] = own.get(phase.name.value, 0.0) + (phase.end_ns - phase.start_ns) / 1e9
        for name, seconds in own.items():
            spans.setdefault(name, []).append(seconds)
    return {
        "work": work,
        "lifts": [lift.number for lift in lifts],
        "heaviest_kg": max(part.mass_kg for part in parts),
        "upended": sum(lift.place is not None and lift.place.is_upended for lift in lifts),
        "turned": sum(lift.place is not None and lift.place.turn != 0 for lift in lifts),
        "points": [min(points), max(points)],
        "phases": {name: [min(seconds), max(seconds)] for name, seconds in spans.items()},
    }


def blind_lifts(revision: Revision) -> list[dict[str, Any]]:
    """Return the planned lifts whose pick or set place the operator cannot see, with the name of what hides it.

    The rule: the straight line from the slewing axis at the jib's height to the middle of the part, where it is stored
    or set, meets a cell of an obstruction, of structure, or of a part that is set before. The crane's own mast and the
    other parts in the yard do not count.
    """
    site, result = revision.plan.site, []
    if not site.cranes:
        return []
    taken = (site.labels == Label.STRUCTURE) | (site.labels == Label.OBSTRUCTION)
    for blocker in site.blockers:
        if blocker.kind == "crane":
            taken[tuple(blocker.cells.T)] = False
    for lift in revision.lifts:
        part = site.components[lift.component]
        target = part.shape.cells + np.array(part.target_vox)
        if lift.status is Status.PLANNED and lift.place is not None:
            stored = lift.place.shape.cells + np.array(lift.place.cell_vox)
            cranes = [site.cranes[number] for number in cranes_of(part)]
            hidden = [
                where
                for where, cells in (("pick", stored), ("set", target))
                if any(_hidden(site, crane, cells, taken) for crane in cranes)
            ]
            if hidden:
                result.append({"number": lift.number, "order": lift.order, "hidden": hidden})
        if lift.is_set:
            taken[tuple(target.T)] = True
    return result


def _hidden(site: Site, crane: TowerCrane, cells: NDArray[np.int64], taken: NDArray[np.bool_]) -> bool:
    size_m, origin = site.frame.voxel_size_m, np.array(site.frame.origin_m)
    # The operator is taken to look from the slewing axis, at the jib's lower edge.
    eye = (np.array([*crane.base_m[:2], outline_of(crane).jib_m[0]]) - origin) / size_m
    middle = (cells.min(axis=0) + cells.max(axis=0) + 1) / 2.0
    count = int(np.ceil(4.0 * np.abs(eye - middle).max())) + 1
    line = np.floor(np.linspace(eye, middle, count)).astype(np.int64)
    line = line[((line >= 0) & (line < np.array(site.shape))).all(axis=1)]
    met = np.ravel_multi_index(tuple(line[taken[tuple(line.T)]].T), taken.shape)
    return not np.isin(met, np.ravel_multi_index(tuple(cells.T), taken.shape)).all()
