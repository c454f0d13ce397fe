"""What the crane does not lift, in groups: parts cast in place, and bundles of parts that are set by hand."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

from bimvox.records.lift import NOT_LIFTED, Lift
from bimvox.records.motion import LiftMotion
from bimvox.records.other_means import needed_by_ns
from bimvox.records.steps import Steps
from bimvox.site.component import Component
from bimvox.site.means import HOW, Means
from bimvox.site.site import Site


@dataclass(frozen=True, slots=True)
class NotLifted:
    """The parts of a storey and kind that the crane does not lift. Those set by hand come up as one bundle.

    Attributes:
        means: How they get to their places.
        storey: Name of their storey, if any.
        kind: Name of their type, otherwise their class.
        lifts: Their entries in the sequence, in order.
        mass_kg: Their mass together.
        needed_by_ns: When the first of them is needed; None if not known.
        begins_ns: When the work at them begins, in elapsed time; None if not known.
        ends_ns: When the work at all of them has ended.
        carries_ns: When all of them carry what rests on them.
        crane_s: Crane time of the material lift that brings the bundle; None if people carry it, or it is cast. It has
            no path, is not proven, and is not in the plan's crane time.
    """

    means: Means
    storey: str | None
    kind: str
    lifts: tuple[Lift, ...]
    mass_kg: float
    needed_by_ns: int | None
    begins_ns: int | None = None
    ends_ns: int | None = None
    carries_ns: int | None = None
    crane_s: float | None = None

    @property
    def name(self) -> str:
        """What the group is called: ``bundle: 24 railings, Level 2``."""
        where = "" if self.storey is None else f", {self.storey}"
        what = "bundle" if self.means is Means.BY_HAND else HOW[self.means]
        return f"{what}: {len(self.lifts):,} x {self.kind}{where}"

    def to_dict(self) -> dict[str, Any]:
        """Return the group for the JSON documents."""
        return {
            "name": self.name,
            "means": self.means.value,
            "storey": self.storey,
            "kind": self.kind,
            "parts": len(self.lifts),
            "mass_kg": round(self.mass_kg, 1),
            "numbers": [lift.number for lift in self.lifts],
            "reason": self.lifts[0].reason,
            "needed_by_s": _seconds(self.needed_by_ns),
            "begins_s": _seconds(self.begins_ns),
            "ends_s": _seconds(self.ends_ns),
            "carries_s": _seconds(self.carries_ns),
            "material_lift_s": self.crane_s,
        }


def not_lifted_groups(
    site: Site, lifts: Iterable[Lift], motions: Iterable[LiftMotion], steps: Steps
) -> tuple[NotLifted, ...]:
    """Return the parts of a plan that the crane does not lift, by means, storey and kind, in the order of need."""
    groups: dict[tuple[Means, str | None, str], list[Lift]] = {}
    chosen = sorted((lift for lift in lifts if lift.status in NOT_LIFTED), key=lambda lift: lift.order)
    for lift in chosen:
        component = site.components[lift.component]
        groups.setdefault((component.means, component.storey, _kind(component)), []).append(lift)
    needed_ns = needed_by_ns(chosen, motions)
    of_order = steps.of_order
    found = []
    for key, own in groups.items():
        mass_kg = _mass_kg(site, own)
        group = NotLifted(*key, tuple(own), mass_kg, needed_ns[own[0].order], crane_s=_crane_s(site, key[0], mass_kg))
        work = [of_order[lift.order] for lift in own if lift.order in of_order]
        if work:
            group = replace(
                group,
                begins_ns=min(step.begins_ns for step in work),
                ends_ns=max(step.ends_ns for step in work),
                carries_ns=max(step.carries_ns for step in work),
            )
        found.append(group)
    return tuple(found)


def _crane_s(site: Site, means: Means, mass_kg: float) -> float | None:
    """Return the crane time of the material lift of a bundle; None if people carry it."""
    casting = site.rules.casting
    is_load = site.cranes and means is Means.BY_HAND and mass_kg > casting.bundle_kg
    return casting.bundle_s if is_load else None


def _seconds(at_ns: int | None) -> float | None:
    return None if at_ns is None else round(at_ns / 1e9, 3)


def _kind(component: Component) -> str:
    return component.type_name or component.ifc_class


def _mass_kg(site: Site, lifts: Iterable[Lift]) -> float:
    return sum(site.components[lift.component].mass_kg for lift in lifts)
