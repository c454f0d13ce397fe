"""Lifts and proofs as records: the values that both page and report show."""

from __future__ import annotations

from typing import Any

import numpy as np

from bimvox.crane.kinematics import hook_of
from bimvox.crane.load_chart import capacity_kg, utilisation
from bimvox.records.lift import Lift
from bimvox.records.motion import LiftMotion
from bimvox.records.steps import needed_by_ns
from bimvox.records.track import heading_in_words
from bimvox.rendering.page.blob import rounded
from bimvox.rendering.page.source import Revision
from bimvox.site.component import Component
from bimvox.site.governing_wind import permitted_for
from bimvox.site.lifting import hung_kg
from bimvox.site.part_names import names_by_id, with_names
from bimvox.site.site import Site


def lift_record(revision: Revision, lift: Lift) -> dict[str, Any]:
    """Return the record of a lift, without its motion, which the caller adds."""
    site = revision.plan.site
    component = site.components[lift.component]
    place = lift.place
    motion = next((m for m in revision.motions if m.order == lift.order), None)
    culprits = revision.proof.culprits if revision.proof else frozenset()
    carried = any(lift is own for own in revision.plan.lifts)
    return {
        "number": lift.number,
        "order": lift.order,
        "part": lift.component,
        "status": lift.status.value,
        "carried": carried,
        "method": lift.method.value if lift.method else None,
        "moves": lift.moves,
        "shortest_moves": lift.shortest_moves,
        "contact_moves": lift.contact_moves,
        "reason": lift.reason and with_names(lift.reason, names_by_id(site)),
        "blocked_by": list(lift.blocked_by),
        "by_other_means": lift.by_other_means,
        "needed_by_s": _needed_by_s(revision, lift),
        **_elapsed(revision, lift, motion),
        "delivery": place.delivery if place else None,
        "stored": place.pose.value if place else None,
        "turn": place.turn if place else 0,
        "start_m": rounded(site.frame.corner_of(place.cell_vox)) if place else None,
        "start_size_m": [round(n * site.frame.voxel_size_m, 6) for n in place.shape.size_vox] if place else None,
        "lifting": _lifting(site, component),
        "clearance_m": lift.clearance_m,
        "rope_clearance_m": lift.rope_clearance_m,
        "heading": heading_in_words(lift, motion),
        "proven": None if revision.proof is None or lift.path_vox is None else component.id not in culprits,
        "current": revision.proof is None or component.id not in revision.proof.not_current,
        "duration_s": motion.loaded.duration_s if motion else None,
        "bound_s": motion.loaded.bound_s if motion else None,
        "samples": len(motion.samples()[0]) if motion else None,
        "governs": _governing(site, motion) if motion else None,
        "pick": _hook(site, motion, last=False) if motion else None,
        "set": _hook(site, motion, last=True) if motion else None,
    }


def _elapsed(revision: Revision, lift: Lift, motion: LiftMotion | None) -> dict[str, Any]:
    """Return the elapsed time at which a lift starts, and the times of a step; None for what does not apply."""
    step = revision.steps.of_order.get(lift.order)
    return {
        "elapsed_s": None if motion is None else revision.steps.starting_ns(motion.start_ns) / 1e9,
        "step": None if step is None else step.seconds(),
    }


def _needed_by_s(revision: Revision, lift: Lift) -> float | None:
    at_ns = needed_by_ns([lift], revision.motions).get(lift.order)
    return None if at_ns is None else at_ns / 1e9


def proof_record(revision: Revision) -> dict[str, Any] | None:
    """Return the result of a proof with all its checks, and the lifts that it proves against earlier obstructions only.

    None if no proof was made.
    """
    proof = revision.proof
    if proof is None:
        return None
    checks = [
        {
            "name": check.name,
            "passed": check.passed,
            "samples": check.samples,
            "worst": None if check.worst is None or not np.isfinite(check.worst) else round(float(check.worst), 9),
            "unit": check.unit,
            "failed": check.failed,
            "failures": list(check.failures),
        }
        for check in proof.checks
    ]
    components = revision.plan.site.components
    earlier = [lift for lift in revision.lifts if components[lift.component].id in proof.not_current]
    not_current = [
        {
            "order": lift.order,
            "number": lift.number,
            "component": components[lift.component].id,
            "name": components[lift.component].label,
        }
        for lift in earlier
    ]
    claims = [claim.to_dict() for claim in proof.claims]
    return {"verified": proof.verified, "checks": checks, "not_current": not_current, "claims": claims}


def remark_records(revision: Revision) -> list[dict[str, Any]]:
    """Return the remarks as ``bimvox verify --json`` gives them."""
    return [remark.to_dict() for remark in revision.remarks]


def _lifting(site: Site, component: Component) -> dict[str, Any]:
    """Return lifting points, sling height, gear, and the wind that the sail area permits."""
    crane = site.crane_of(component)
    wind = None if crane is None else permitted_for(site, crane, component)
    rise_m = component.lifting.sling_rise_vox * site.frame.voxel_size_m
    return {
        "source": component.lifting.source,
        "points_m": [list(point) for point in component.lifting.points_m],
        "sling_m": None if crane is None else round(crane.sling_m + rise_m, 6),
        "sail_area_m2": component.sail_area_m2,
        "permitted_wind_m_s": wind,
        "rig": None if component.lifting.rig is None else component.lifting.rig.document(),
    }


def _governing(site: Site, motion: LiftMotion) -> dict[str, Any] | None:
    """Return the governing sample: the highest utilisation, load and rigging together."""
    crane = site.cranes[motion.crane]
    mass_kg = hung_kg(crane, site.components[motion.component])
    held = (motion.raising, motion.loaded)
    time_ns = np.concatenate([part.time_ns for part in held])
    radius_m = np.concatenate([part.radius_m for part in held])
    used = utilisation(crane.chart, radius_m, mass_kg)
    worst = int(np.argmax(used))
    return {
        "utilisation": float(used[worst]) if np.isfinite(used[worst]) else None,
        "time_s": (motion.start_ns + int(time_ns[worst])) / 1e9,
        "phase": motion.phase_at(motion.start_ns + int(time_ns[worst])).name.value,
        "radius_m": float(radius_m[worst]),
        "capacity_kg": float(capacity_kg(crane.chart, float(radius_m[worst]))),
        "load_kg": mass_kg,
    }


def _hook(site: Site, motion: LiftMotion, *, last: bool) -> dict[str, Any]:
    """Return the hook's position at pick or set."""
    crane = site.cranes[motion.crane]
    part, n = (motion.loaded, -1) if last else (motion.raising, 0)
    slew_rad, radius_m, height_m = float(part.slew_rad[n]), float(part.radius_m[n]), float(part.height_m[n])
    return {
        "hook_m": rounded(hook_of(crane, slew_rad, radius_m, height_m)),
        "slew_rad": slew_rad,
        "radius_m": radius_m,
        "height_m": height_m,
    }
