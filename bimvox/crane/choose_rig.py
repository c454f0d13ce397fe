"""The choice of a part's rig from a catalogue: the smallest gear whose working load limits hold.

The rules, with their sources:

* Legs of a sling lean by no more than the site's rule allows, and never by more than 60 degrees (EN 818-4).
* Of several legs not all are taken to carry, because a rigid load does not share itself out: two of three or four, one
  of two whose angles differ (DGUV Regel 100-500, as stated in Pfeifer's operating manual of round slings; that only two
  of four anchors carry is also Halfen's rule for precast units). Both legs of a symmetric pair carry: their shares
  follow from the centre of mass.
* A sling carries no more than so many legs times the cosine of their angle, and no more than the factor on its tag: 1.4
  and 2.1 times one leg up to 45 degrees, 1.0 and 1.5 times beyond (EN 818-4, uniform load method).
* A choke hitch leaves a round sling 0.8 of its limit (EN 1492-2).

Working load limits are compared with masses at rest: the safety factors of the standards (chain 4, textile 7) contain
what a hoist adds in ordinary service. The anchors in the part are not the gear's: see the lift plan.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from math import atan2, ceil, cos, degrees, hypot, inf, radians, tan

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.gear import Gear, GearFamily, GearKind, GearSize, Rig, RigPart

MOST_ANGLE_RAD = radians(60.0)
"""No leg leans by more (EN 818-4)."""
_STEEP_RAD = radians(45.0)
_EQUAL_RAD = radians(5.0)
"""Two legs carry alike if their angles differ by no more; an assumption."""
_SLACK = 1e-9
LOWER_M = 1.0
"""Least height of the slings below a spreader; an assumption."""


class NoGearError(Exception):
    """No gear of the catalogue serves; the message says what is needed, and what the strongest carries."""


@dataclass(frozen=True, slots=True)
class _Pull:
    """The legs of one sling.

    Attributes:
        legs: How many there are.
        carrying: How many are taken to carry.
        angle_rad: Largest angle to the vertical.
        length_m: Longest leg.
    """

    legs: int
    carrying: int
    angle_rad: float
    length_m: float

    @property
    def factor(self) -> float:
        """Working load limit of the sling, as a multiple of that of one leg."""
        return sling_factor(self.legs, self.carrying, self.angle_rad)

    def of_one_leg(self, load_kg: float) -> float:
        """Return the pull in the leg that carries most, kg."""
        return load_kg / (self.carrying * cos(self.angle_rad))


def sling_factor(legs: int, carrying: int, angle_rad: float) -> float:
    """Return the working load limit of a sling as a multiple of that of one leg.

    Args:
        legs: Number of its legs.
        carrying: How many of them are taken to carry.
        angle_rad: Largest angle of a leg to the vertical.
    """
    on_tag = {1: (1.0, 1.0), 2: (1.4, 1.0)}.get(legs, (2.1, 1.5))
    return min(carrying * cos(angle_rad), on_tag[angle_rad > _STEEP_RAD + _SLACK])


def choose_rig(
    mass_kg: float,
    points_m: Sequence[tuple[float, float, float]],
    *,
    usual_m: float,
    step_m: float,
    most_angle_rad: float,
    attached_by: GearKind,
    gear: Gear,
) -> Rig:
    """Return the rig of a part.

    Args:
        mass_kg: Its mass.
        points_m: One to four lifting points (x, y, z): from the hook's vertical, and from the part's top upwards.
        usual_m: The hook is at least so high above the part's top.
        step_m: Above that, it is raised by whole multiples of this length.
        most_angle_rad: Largest angle of a leg to the vertical.
        attached_by: A shackle for each lifting anchor, or a round sling choked round the part.
        gear: The catalogue.

    Raises:
        NoGearError: If no gear serves.
    """
    at = np.array(points_m, np.float64).reshape(-1, 3)
    angle_rad = min(most_angle_rad, MOST_ANGLE_RAD)
    job = _Job(mass_kg, usual_m, step_m, angle_rad, attached_by, gear)
    apart_m = max(float(np.hypot(*(at[:, :2] - one[:2]).T).max()) for one in at)
    ways = [job.direct, job.with_spreader] if apart_m <= gear.spreader_from_m else [job.with_spreader, job.direct]
    try:
        return ways[0](at)
    except NoGearError:
        with suppress(NoGearError):
            return ways[1](at)
        raise


@dataclass(frozen=True, slots=True)
class _Job:
    mass_kg: float
    usual_m: float
    step_m: float
    angle_rad: float
    attached_by: GearKind
    gear: Gear

    def direct(self, at: NDArray[np.float64]) -> Rig:
        """Return the rig of one sling from the hook to all points."""
        outwards_m = np.hypot(at[:, 0], at[:, 1])
        height_m = self._height_m(float((at[:, 2] + outwards_m / tan(self.angle_rad)).max()))
        pull = _pull(np.column_stack([outwards_m, height_m - at[:, 2]]))
        attached = self._attached(pull, self.mass_kg, len(at))
        sling = self._sling(pull, self.mass_kg + _total_kg(attached), 1)
        parts = (sling, *attached)
        return Rig("1_leg" if len(at) == 1 else f"{len(at)}_legs", height_m, _total_kg(parts), parts)

    def with_spreader(self, at: NDArray[np.float64]) -> Rig:
        """Return the rig with a spreader above two groups of points, and a sling for each group."""
        if len(at) not in (2, 4):
            raise NoGearError(f"a spreader is for 2 or 4 lifting points, not {len(at)}")
        apart_m = np.hypot(*(at[:, None, :2] - at[None, :, :2]).transpose(2, 0, 1))
        first, last = np.unravel_index(int(np.argmax(apart_m)), apart_m.shape)
        along = at[last, :2] - at[first, :2]
        if len(at) == 4:  # along the longer sides, not along a diagonal
            centre = at[:, :2].mean(axis=0)
            values, vectors = np.linalg.eigh(np.cov((at[:, :2] - centre).T))
            along = vectors[:, int(np.argmax(values))]
        along = along / hypot(*along)
        offsets_m = at[:, :2] @ along
        groups = [np.flatnonzero(offsets_m < 0.0), np.flatnonzero(offsets_m >= 0.0)]
        if any(len(group) != len(at) // 2 for group in groups):
            raise NoGearError("its lifting points are not on both sides of its centre of mass")
        ends_m = [abs(float(offsets_m[group].mean())) for group in groups]
        aside_m = [np.hypot(*(at[group, :2] - at[group, :2].mean(axis=0)).T) for group in groups]
        across_m = max(float(aside.max()) for aside in aside_m)
        drop_m = float(at[:, 2].max()) + max(LOWER_M, across_m / tan(self.angle_rad))
        lower = [_pull(np.column_stack([m, drop_m - at[g, 2]])) for m, g in zip(aside_m, groups, strict=True)]
        worse = max(lower, key=lambda pull: pull.of_one_leg(1.0))
        shares = [ends_m[1] / sum(ends_m), ends_m[0] / sum(ends_m)]
        below_kg = self.mass_kg * max(shares)
        attached = self._attached(worse, below_kg, len(at))
        slings = self._sling(worse, (self.mass_kg + _total_kg(attached)) * max(shares), 2)
        hung_kg = self.mass_kg + _total_kg((slings, *attached))
        return self._under_spreader(ends_m, drop_m, hung_kg, (slings, *attached))

    def _under_spreader(
        self, ends_m: Sequence[float], drop_m: float, hung_kg: float, below: tuple[RigPart, ...]
    ) -> Rig:
        span_m, best = sum(ends_m), ""
        for family, size in self.gear.of_kind(GearKind.SPREADER):
            limit_kg = size.limit_at_kg(span_m)
            angle_rad = min(self.angle_rad, family.most_angle_rad)
            top_m = drop_m + family.height_m
            height_m = self._height_m(top_m + max(ends_m) / tan(angle_rad))
            pull = _pull(np.array([[end, height_m - top_m] for end in ends_m]))
            if limit_kg and hung_kg <= limit_kg:
                name = f"{family.name} {size.name}"
                mass_kg = size.mass_kg + size.kg_per_m * span_m
                spreader = RigPart(
                    GearKind.SPREADER, name, 1, limit_kg, limit_kg, hung_kg, mass_kg, 2, 2, pull.angle_rad, span_m
                )
                sling = self._sling(pull, hung_kg + mass_kg, 1)
                parts = (sling, spreader, *below)
                return Rig(f"spreader_{below[-1].count}", height_m, _total_kg(parts), parts, drop_m, top_m)
            longest_m = size.chart[-1][0]
            carries = f"carries {_t(limit_kg)}" if limit_kg else f"is at most {longest_m:g} m long"
            best = f"the largest, {family.name} {size.name}, {carries}"
        raise NoGearError(f"no spreader of {span_m:.1f} m carries {_t(hung_kg)}: {best or 'the catalogue has none'}")

    def _attached(self, pull: _Pull, load_kg: float, count: int) -> tuple[RigPart, ...]:
        """Return what connects the legs with the part: one piece at each point."""
        most_kg, best = pull.of_one_leg(load_kg), ""
        for family, size in self.gear.of_kind(self.attached_by):
            wll_kg = size.wll_kg * family.choked
            made_m = family.lengths_m[0] if family.lengths_m else 0.0
            if most_kg <= wll_kg * (1.0 + _SLACK):
                mass_kg = size.mass_kg + size.kg_per_m * made_m
                name = f"{family.name} {size.name}"
                return (
                    RigPart(
                        self.attached_by, name, count, size.wll_kg, wll_kg, most_kg, mass_kg,
                        angle_rad=pull.angle_rad, made_m=made_m,
                    ),
                )  # fmt: skip
            best = f"the largest, {family.name} {size.name}, carries {_t(wll_kg)}"
        what = self.attached_by.value.replace("_", " ")
        raise NoGearError(
            f"no {what} carries {_t(most_kg)}, the pull of a leg at {degrees(pull.angle_rad):.0f} degrees with "
            f"{pull.carrying} of {pull.legs} carrying: {best or 'the catalogue has none'}"
        )

    def _sling(self, pull: _Pull, load_kg: float, count: int) -> RigPart:
        """Return the smallest chain sling for a load: ``count`` of them."""
        best = ""
        for family, size in self.gear.of_kind(GearKind.CHAIN_SLING):
            wll_kg = size.wll_kg * pull.factor
            made_m = next((m for m in family.lengths_m if pull.length_m <= m + _SLACK), None)
            if made_m is not None and load_kg <= wll_kg * (1.0 + _SLACK):
                return _chain(family, size, pull, load_kg, count, made_m)
            carries = f"carries {_t(wll_kg)}" if made_m is not None else f"is at most {family.lengths_m[-1]:g} m long"
            best = f"the largest, {family.name}, {size.name}, {carries}"
        raise NoGearError(
            f"no chain sling with {pull.legs} leg{'s' * (pull.legs > 1)} of {pull.length_m:.1f} m at "
            f"{degrees(pull.angle_rad):.0f} degrees carries {_t(load_kg)}: {best or 'the catalogue has none'}"
        )

    def _height_m(self, needed_m: float) -> float:
        return self.usual_m + self.step_m * max(0, ceil((needed_m - self.usual_m) / self.step_m - _SLACK))


def _chain(family: GearFamily, size: GearSize, pull: _Pull, load_kg: float, count: int, made_m: float) -> RigPart:
    mass_kg = size.mass_kg + pull.legs * (size.leg_kg + size.kg_per_m * made_m)
    return RigPart(
        GearKind.CHAIN_SLING, f"{family.name}, {size.name}", count, size.wll_kg, size.wll_kg * pull.factor, load_kg,
        mass_kg, pull.legs, pull.carrying, pull.angle_rad, pull.length_m, made_m,
    )  # fmt: skip


def _pull(out_and_down_m: NDArray[np.float64]) -> _Pull:
    """Return the legs that go out and down by (N, 2) lengths."""
    angles = [atan2(out, down) if down > 0.0 else inf for out, down in out_and_down_m.tolist()]
    if max(angles) > MOST_ANGLE_RAD + _SLACK:
        raise NoGearError("a leg would lean by more than 60 degrees to the vertical")
    legs = len(angles)
    carrying = {1: 1, 2: 2 if max(angles) - min(angles) <= _EQUAL_RAD else 1}.get(legs, 2)
    return _Pull(legs, carrying, max(angles), max(hypot(*row) for row in out_and_down_m.tolist()))


def _total_kg(parts: Sequence[RigPart]) -> float:
    return float(sum(part.count * part.mass_kg for part in parts))


def _t(mass_kg: float) -> str:
    # Three digits, without an exponent from 1000 t on.
    return f"{float(f'{mass_kg / 1000.0:.3g}'):,.10g} t"
