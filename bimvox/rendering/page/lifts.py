"""Lifts and proofs as records: the values that both page and report show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Literal

import numpy as np

from bimvox.crane.kinematics import hook_of
from bimvox.crane.sectors import capacities_kg, name_towards, utilisations
from bimvox.motion.figures import capacity_used
from bimvox.records.declared import LATER, Count, Maybe, Number, Record, Several
from bimvox.records.lift import Lift, YardPlace
from bimvox.records.motion import LiftMotion, by_each_crane
from bimvox.records.proof import CHECK, CLAIM
from bimvox.records.steps import Step, needed_by_ns
from bimvox.records.track import heading_in_words
from bimvox.rendering.page.geometry import rounded
from bimvox.rendering.page.source import Revision
from bimvox.site.component import Component
from bimvox.site.config.validation import Point3
from bimvox.site.lifting import hung_kg, permitted_for
from bimvox.site.site import Site, names_by_id, with_names
from bimvox.site.tandem import part_on

_EPOCH = datetime(1970, 1, 1)


@dataclass(frozen=True, slots=True, eq=False)
class Shown:
    """A lift of a plan, as a ``Revision`` or a ``PlanLog`` holds it, with all that its record is made from."""

    source: Any
    lift: Lift
    motion: LiftMotion | None
    step: Step | None

    @property
    def site(self) -> Site:
        """The site."""
        return self.source.plan.site  # type: ignore[no-any-return]

    @property
    def component(self) -> Component:
        """Its part."""
        return self.site.components[self.lift.component]

    @property
    def place(self) -> YardPlace | None:
        """Its part's place in the yard."""
        return self.lift.place


_STEP = Record(
    "PageStep",
    "Work that the crane does not do, elapsed time.",
    ("begins_s", float, "When it begins."),
    ("ends_s", float, "When it ends."),
    ("carries_s", float, "From when it carries."),
    ("in_words", Maybe(tuple[str, str, str]), "The same three times in words; null of an extract.", LATER),
)
UNLOADING = Record(
    "PageUnloading",
    "How the crane brings a part from the truck to its place in the yard; a bound, not a planned motion.",
    ("radius_m", float, "Radius of the hook over the truck."),
    ("utilisation", float, "Share of the capacity there."),
    ("crane_s", float, "Crane time to the yard and back.", "duration_s"),
)
DELIVERY = Record(
    "PageDelivery",
    "A delivery that the crane unloads.",
    ("number", Count, "From 0."),
    ("begins_s", Maybe(float), "When its unloading begins, local time, seconds after 1970; null without dates."),
    ("ends_s", Maybe(float), "When it ends."),
)
_LIFTING = Record(
    "PageLifting",
    "How a part hangs.",
    ("source", str, "Where its lifting points come from."),
    ("points_m", tuple[Point3, ...], "Its lifting points when it is set."),
    ("sling_m", Maybe(float), "Hook above the part's top; null without a crane."),
    ("sail_area_m2", float, "Its largest area against the wind."),
    ("permitted_wind_m_s", Maybe(float), "Gust in which the lift is permitted; null without a crane."),
    ("rig", Maybe(dict[str, Any]), "Its gear, as in the log; null if none was chosen."),
    ("gust_swing_m", Maybe(float), "How far it swings out in that gust, in transit; null without a motion or wind."),
)
_GOVERNING = Record(
    "PageGoverning",
    "The sample with the highest utilisation.",
    ("utilisation", Maybe(float), "Share of the capacity; null beyond the chart."),
    ("time_s", float, "When, crane time."),
    ("phase", str, "The phase."),
    ("radius_m", float, "Radius of the hook."),
    ("capacity_kg", float, "Gross capacity there: rigging and hook block count as load."),
    ("load_kg", float, "Load, rigging and hook block."),
    ("sector", str, "Sector of a mobile crane whose chart governs; empty if the chart holds all around."),
)
_HOOK = Record(
    "PageHook",
    "The hook at pick or set.",
    ("hook_m", Point3, "Its position."),
    ("slew_rad", float, "Slewing angle from the x axis, counter-clockwise."),
    ("radius_m", float, "Its radius."),
    ("height_m", float, "Its height."),
)
FLIP = Record(
    "PageFlip",
    "How a part is turned over in the air between the main and the auxiliary hook of its crane.",
    ("angle_deg", tuple[float, ...], "Angles of the turn: 0 lying, 90 upright."),
    ("main_kg", tuple[float, ...], "Share of its mass on the main hook at each.", lambda it: _rounded(it.main_kg)),
    ("auxiliary_kg", tuple[float, ...], "Share of its mass on the auxiliary hook at each.",
     lambda it: _rounded(it.auxiliary_kg)),
    ("main_used", float, "Largest share of the capacity of the main hook, rigging and hook block included."),
    ("auxiliary_used", float, "The same of the auxiliary hook."),
    ("both_used", float, "The same of the load chart by both."),
    ("radius_m", float, "Radius of the main hook.", lambda it: round(it.radius_m, 3)),
    ("clear_m", float, "Least distance above the ground while it turns."),
    ("lean_rad", float, "Largest angle of a rope to the vertical."),
    ("main_m", Point3, "Where the main hook holds it, with the part at its place.", lambda it: list(it.main_m)),
    ("auxiliary_m", Point3, "Where the auxiliary hook holds it, the same way.", lambda it: list(it.auxiliary_m)),
)  # fmt: skip


TANDEM = Record(
    "PageTandem",
    "How two cranes carry a part together; each list has the first crane, then the second one.",
    ("cranes", tuple[Count, ...], "Their numbers, from 0.", lambda it: list(it.cranes)),
    ("load_kg", tuple[float, ...], "Share of its mass on each hook while it hangs level.",
     lambda it: _rounded(it.load_kg)),
    ("most_kg", tuple[float, ...], "The same while it hangs out of level.", lambda it: _rounded(it.most_kg)),
    ("used", tuple[float, ...], "Largest share of each load chart, rigging and hook block included.",
     lambda it: [round(one, 6) for one in it.used]),
    ("radius_m", tuple[float, ...], "Largest radius of each hook.", lambda it: [round(one, 3) for one in it.radius_m]),
    ("apart_m", float, "Distance of the two hooks.", lambda it: round(it.apart_m, 3)),
    ("off_level_rad", float, "How far it may hang out of level."),
    ("points_m", tuple[Point3, ...], "Where each holds it, with the part at its place.",
     lambda it: [list(one) for one in it.points_m]),
)  # fmt: skip


def _rounded(masses_kg: Sequence[float]) -> list[float]:
    return [round(one, 1) for one in masses_kg]


LIFT = Record(
    "PageLift",
    "A lift.",
    ("number", Number, "Its number, from 1.", "lift.number"),
    ("order", Count, "Its position in the sequence, from 0.", "lift.order"),
    ("part", Count, "Index in ``parts``.", "lift.component"),
    ("status", Literal["planned", "infeasible", "in_situ", "built", "by_hand"], "Its status.", "lift.status.value"),
    ("carried", bool, "Whether the log carries it.", lambda it: any(it.lift is own for own in it.source.plan.lifts)),
    ("method", Maybe(str), "How its path was found.", "lift.found_by"),
    ("moves", Maybe(Count), "Unit moves of its path.", "lift.moves"),
    ("shortest_moves", Maybe(Count), "The fewest possible.", "lift.shortest_moves"),
    ("contact_moves", Maybe(Count), "How many of them are the last moves, near other parts.", "lift.contact_moves"),
    ("reason", Maybe(str), "Why it is infeasible.",
     lambda it: it.lift.reason and with_names(it.lift.reason, names_by_id(it.site))),
    ("blocked_by", tuple[str, ...], "Ids of what blocks it.", lambda it: list(it.lift.blocked_by)),
    ("by_other_means", bool, "Whether it counts as set by other means.", "lift.by_other_means"),
    ("needed_by_s", Maybe(float), "When such a part is needed, crane time.",
     lambda it: _needed_by_s(it.source.motions, it.lift)),
    ("needed_by_in_words", Maybe(str), "The same in words.",
     lambda it: it.source.times and it.source.times.clock_in_words(needed_ns(it.source.motions, it.lift)), None),
    ("begins_in_words", Maybe(str), "When it starts, in words; none of an extract, or without a crane.",
     lambda it: ((it.source.times and it.source.times.span_in_words(it.lift.order)) or (None,))[0], None),
    ("elapsed_s", Maybe(float), "When it starts, elapsed time.",
     lambda it: it.motion and it.source.steps.starting_ns(it.motion.start_ns) / 1e9),
    ("step", Maybe(_STEP), "Its times, if the crane does not lift it.",
     lambda it: it.step and _step(it.source, it.step)),
    ("delivery", Maybe(Count), "Its delivery, from 0.", "place.delivery"),
    ("unloading", Maybe(UNLOADING), "How the crane unloads it; null if no place for trucks is known.", LATER, None),
    ("stored", Maybe(Literal["as_built", "lying_x", "lying_y"]), "How it is stored.", "place.pose.value"),
    ("turn", Count, "Quarter turns of the stored part.", lambda it: it.place.turn if it.place else 0),
    ("start_m", Maybe(Point3), "Lowest corner of the stored part's cells.",
     lambda it: it.place and rounded(it.site.frame.corner_of(it.place.cell_vox))),
    ("start_size_m", Maybe(Point3), "Size of their box.",
     lambda it: it.place and [round(n * it.site.frame.voxel_size_m, 6) for n in it.place.shape.size_vox]),
    ("lifting", _LIFTING, "How it hangs.", lambda it: _lifting(it.site, it.component, it.motion)),
    ("clearance_m", Maybe(float), "Clearance of the load in transit, if it is less than the rule's.",
     "lift.clearance_m"),
    ("rope_clearance_m", Maybe(float), "The same of hook and rope.", "lift.rope_clearance_m"),
    ("departure_clearance_m", Maybe(float), "The same straight up from the yard.", "lift.departure_clearance_m"),
    ("approach_clearance_m", Maybe(float), "The same on its last moves.", "lift.approach_clearance_m"),
    ("upending_clearance_m", Maybe(float), "The same while it is upended.", "lift.upending_clearance_m"),
    ("turning_clearance_m", Maybe(float), "The same while it is turned in the yard.", "lift.turning_clearance_m"),
    ("flip", Maybe(FLIP), "How it is turned over between two hooks.",
     lambda it: None if it.lift.flip is None else FLIP.of(it.lift.flip), None),
    ("tandem", Maybe(TANDEM), "How two cranes carry it together.",
     lambda it: None if it.lift.tandem is None else TANDEM.of(it.lift.tandem), None),
    ("heading", Maybe(str), "How its heading is kept; null without a path.",
     lambda it: heading_in_words(it.lift, it.motion)),
    ("proven", Maybe(bool), "Whether the proof holds for it; null without a proof or a path.",
     lambda it: (
         None if (proof := it.source.proof) is None or it.lift.path_vox is None
         else it.component.id not in proof.culprits
     )),
    ("current", bool, "Whether it is proven against the current obstructions.",
     lambda it: it.source.proof is None or it.component.id not in it.source.proof.not_current),
    ("duration_s", Maybe(float), "From pick to set.", "motion.loaded.duration_s"),
    ("bound_s", Maybe(float), "The synchronised point-to-point time.", "motion.loaded.bound_s"),
    ("samples", Maybe(Count), "Samples of its motion in the log.",
     lambda it: it.motion and len(it.motion.samples()[0])),
    ("governs", Maybe(_GOVERNING), "Its governing sample.", lambda it: it.motion and governing(it.site, it.motion)),
    ("pick", Maybe(_HOOK), "The hook when it is picked.",
     lambda it: it.motion and _hook(it.site, it.motion, last=False)),
    ("set", Maybe(_HOOK), "The hook when it is set.", lambda it: it.motion and _hook(it.site, it.motion, last=True)),
    ("motion", Maybe(Count), "Index in ``motions``.", LATER),
    ("begins_s", Maybe(float), "When its motion begins, crane time.", LATER),
    ("critical", bool, "Whether it uses the critical share of the capacity or more, or is beyond the chart.", LATER),
)  # fmt: skip


def _step(revision: Revision, step: Step) -> dict[str, Any]:
    times = revision.times
    found = times and times.of_work([step.order])
    return step.seconds() | {"in_words": [times.in_words(at) for at in found] if times and found else None}


def local_s(at: datetime) -> float:
    """Return a local time as seconds after 1970."""
    return (at - _EPOCH).total_seconds()


def lift_record(revision: Revision, lift: Lift) -> dict[str, Any]:
    """Return the record of a lift, without its motion, which the caller adds."""
    motion = next((m for m in revision.motions if m.order == lift.order), None)
    return LIFT.of(Shown(revision, lift, motion, revision.steps.of_order.get(lift.order)))


def _needed_by_s(motions: Sequence[LiftMotion], lift: Lift) -> float | None:
    at_ns = needed_ns(motions, lift)
    return None if at_ns is None else at_ns / 1e9


def needed_ns(motions: Sequence[LiftMotion], lift: Lift) -> int | None:
    """Return when a part that the crane does not set is needed, on the site's clock; None if not known."""
    return needed_by_ns([lift], motions).get(lift.order)


def is_critical(record: dict[str, Any], share: float) -> bool:
    """Return whether a lift uses this share of the capacity or more; beyond the load chart it does."""
    governs = record["governs"]
    return governs is not None and (governs["utilisation"] is None or governs["utilisation"] >= share)


_NOT_CURRENT = Record(
    "PageNotCurrent",
    "A lift that is proven against earlier obstructions only.",
    ("order", Count, "Its position in the sequence.", lambda lift, _: lift.order),
    ("number", Count, "Its number.", lambda lift, _: lift.number),
    ("component", str, "Id of its part.", lambda _, part: part.id),
    ("name", str, "Name of its part.", lambda _, part: part.label),
)
PROOF = Record(
    "PageProof",
    "A proof.",
    ("verified", bool, "Whether every check passed."),
    ("checks", Several(CHECK), "Its checks."),
    ("not_current", Several(_NOT_CURRENT), "Lifts that it proves against earlier obstructions only."),
    ("claims", Several(CLAIM), "What the log states and it has taken as true."),
)


def proof_record(revision: Revision) -> dict[str, Any] | None:
    """Return the result of a proof with all its checks, and the lifts that it proves against earlier obstructions only.

    None if no proof was made.
    """
    proof, components = revision.proof, revision.plan.site.components
    if proof is None:
        return None
    parts = ((lift, components[lift.component]) for lift in revision.lifts)
    return PROOF.made(
        proof.verified,
        [CHECK.of(check) for check in proof.checks],
        [_NOT_CURRENT.of(lift, part) for lift, part in parts if part.id in proof.not_current],
        [claim.to_dict() for claim in proof.claims],
    )


def _lifting(site: Site, component: Component, motion: LiftMotion | None) -> dict[str, Any]:
    """Return lifting points, sling height, gear, the wind in which the lift is permitted, and the swing in it."""
    crane, wind = site.crane_of(component), None if motion is None else motion.least_wind
    permitted_m_s = None if crane is None else permitted_for(site, crane, component)
    rise_m = component.lifting.sling_rise_vox * site.frame.voxel_size_m
    return _LIFTING.made(
        component.lifting.source,
        [list(point) for point in component.lifting.points_m],
        None if crane is None else round(crane.sling_m + rise_m, 6),
        component.sail_area_m2,
        permitted_m_s if wind is None else wind.speed_m_s,
        None if component.lifting.rig is None else component.lifting.rig.document(),
        None if wind is None else round(wind.swing_m, 3),
    )


def governing(site: Site, motion: LiftMotion) -> dict[str, Any]:
    """Return the governing sample: the furthest out of those with the highest utilisation, rigging included.

    Of a lift by two cranes it is of the one that uses more of its load chart.
    """
    motion = max(by_each_crane([motion]), key=lambda one: capacity_used(site, one))
    crane = site.cranes[motion.crane]
    mass_kg = hung_kg(crane, part_on(site, motion.component, motion.crane))
    held = (motion.raising, motion.loaded)
    time_ns = np.concatenate([part.time_ns for part in held])
    slew_rad, radius_m = (np.concatenate([getattr(part, key) for part in held]) for key in ("slew_rad", "radius_m"))
    used = utilisations(crane, slew_rad, radius_m, mass_kg)
    worst = int(np.argmax(np.where(used == used.max(), radius_m, -np.inf)))
    return _GOVERNING.made(
        float(used[worst]) if np.isfinite(used[worst]) else None,
        (motion.start_ns + int(time_ns[worst])) / 1e9,
        motion.phase_at(motion.start_ns + int(time_ns[worst])).name.value,
        float(radius_m[worst]),
        float(capacities_kg(crane, slew_rad[worst], radius_m[worst])),
        mass_kg,
        name_towards(crane, float(slew_rad[worst])),
    )


def _hook(site: Site, motion: LiftMotion, *, last: bool) -> dict[str, Any]:
    """Return the hook's position at pick or set."""
    crane = site.cranes[motion.crane]
    part, n = (motion.loaded, -1) if last else (motion.raising, 0)
    slew_rad, radius_m, height_m = float(part.slew_rad[n]), float(part.radius_m[n]), float(part.height_m[n])
    return _HOOK.made(rounded(hook_of(crane, slew_rad, radius_m, height_m)), slew_rad, radius_m, height_m)
