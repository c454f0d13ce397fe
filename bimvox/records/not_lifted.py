"""What the crane does not lift, in groups: parts cast in place, and bundles of parts that are set by hand."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from bimvox.records.lift import NOT_LIFTED, Lift
from bimvox.records.motion import LiftMotion
from bimvox.records.other_means import needed_by_ns
from bimvox.site.component import Component
from bimvox.site.means import Means
from bimvox.site.site import Site

HOW = {Means.IN_SITU.value: "cast in place", Means.BY_HAND.value: "set by hand"}
"""What a part is that the crane does not lift, by the status of its lift."""


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
    """

    means: Means
    storey: str | None
    kind: str
    lifts: tuple[Lift, ...]
    mass_kg: float
    needed_by_ns: int | None

    def to_dict(self) -> dict[str, Any]:
        """Return the group for the JSON documents."""
        return {
            "means": self.means.value,
            "storey": self.storey,
            "kind": self.kind,
            "parts": len(self.lifts),
            "mass_kg": round(self.mass_kg, 1),
            "numbers": [lift.number for lift in self.lifts],
            "reason": self.lifts[0].reason,
            "needed_by_s": None if self.needed_by_ns is None else round(self.needed_by_ns / 1e9, 3),
        }


def not_lifted_groups(site: Site, lifts: Iterable[Lift], motions: Iterable[LiftMotion]) -> tuple[NotLifted, ...]:
    """Return the parts of a plan that the crane does not lift, by means, storey and kind, in the order of need."""
    groups: dict[tuple[Means, str | None, str], list[Lift]] = {}
    chosen = sorted((lift for lift in lifts if lift.status in NOT_LIFTED), key=lambda lift: lift.order)
    for lift in chosen:
        component = site.components[lift.component]
        groups.setdefault((component.means, component.storey, _kind(component)), []).append(lift)
    needed_ns = needed_by_ns(chosen, motions)
    return tuple(
        NotLifted(*key, tuple(own), _mass_kg(site, own), needed_ns[own[0].order]) for key, own in groups.items()
    )


def _kind(component: Component) -> str:
    return component.type_name or component.ifc_class


def _mass_kg(site: Site, lifts: Iterable[Lift]) -> float:
    return sum(site.components[lift.component].mass_kg for lift in lifts)
