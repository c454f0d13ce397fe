"""The proof of a part's gear: what each piece carries and may carry, what all weigh, where the hook is, its slings.

Everything is computed again from mass, lifting points and height, by rules written a second time (EN 818-4; DGUV Regel
100-500 for the legs that carry). Working load limits in a straight pull are taken from the log: the proof knows no
catalogue.
"""

from __future__ import annotations

from math import acos, ceil, cos, degrees, hypot, pi, sqrt, tan
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.gear import GearKind, Rig, RigPart
from bimvox.crane.tower_crane import TowerCrane
from bimvox.records.proof import Check
from bimvox.site.component import Component
from bimvox.site.site import Site

_SHARE = 1e-6
_SAME_M = 1e-3
_SAME_RAD = 1e-3
_STEEPEST_RAD = pi / 3.0
_STEEP_RAD = pi / 4.0
_ALIKE_RAD = pi / 36.0
"""Both legs of a pair carry if their angles differ by no more than 5 degrees."""
_CHOKED = 0.8


class _Legs(NamedTuple):
    """Angles to the vertical and lengths of the legs of one sling."""

    angle_rad: NDArray[np.float64]
    length_m: NDArray[np.float64]

    @property
    def carrying(self) -> int:
        count = len(self.angle_rad)
        if count == 2:
            return 2 if float(np.ptp(self.angle_rad)) <= _ALIKE_RAD else 1
        return min(count, 2)

    def most(self, rated_kg: float) -> float:
        """Return what the sling may carry, by the limit of one leg."""
        steepest, count = float(self.angle_rad.max()), len(self.angle_rad)
        beyond = steepest > _STEEP_RAD + _SHARE
        on_tag = 1.0 if count == 1 else (1.0 if beyond else 1.4) if count == 2 else (1.5 if beyond else 2.1)
        return rated_kg * min(on_tag, self.carrying * cos(steepest))

    def pull(self, load_kg: float) -> float:
        """Return the pull of the leg that carries most, kg."""
        return load_kg / self.carrying / cos(float(self.angle_rad.max()))


def rigging_kg(crane: TowerCrane, component: Component) -> float:
    """Return the mass of what hangs between a crane's hook and a component."""
    rig = component.lifting.rig
    return crane.rigging_mass_kg if rig is None else float(sum(part.count * part.mass_kg for part in rig.parts))


def second_block_kg(crane: TowerCrane) -> float:
    """Return the mass of the block of an auxiliary hook, which hangs from the boom in every lift."""
    return 0.0 if crane.auxiliary is None else crane.auxiliary.hook_block_kg


def check_rigging(check: Check, site: Site, component: Component, chosen: frozenset[int]) -> None:
    """Check the gear of a part that is lifted.

    ``chosen``: indices of the cranes for whose parts gear is chosen.
    """
    name, rig, crane = component.id, component.lifting.rig, site.crane_of(component)
    refused = component.lifting.no_gear
    check.look(not refused, f"{name}: it is lifted, but no gear serves: {refused}")
    if rig is None:
        if component.crane in chosen and not refused and component.tandem is None:
            check.look(False, f"{name}: it is lifted without gear, but gear is chosen for other parts of its crane")
        return
    if crane is None:
        check.look(False, f"{name}: it has gear, but no crane")
        return
    parts = rig.parts
    known = bool(parts) and all(
        part.count > 0 and part.rated_kg > 0.0 and part.mass_kg >= 0.0 and part.legs > 0 for part in parts
    )
    check.look(known, f"{name}: its gear is not a list of pieces")
    if not known:
        return
    total_kg = rigging_kg(crane, component)
    check.look(_same(rig.mass_kg, total_kg), f"{name}: its gear weighs {total_kg:.1f} kg, not {rig.mass_kg:.1f} kg")
    height_m = crane.sling_m + component.lifting.sling_rise_vox * site.frame.voxel_size_m
    check.look(
        abs(height_m - rig.height_m) <= _SAME_M,
        f"{name}: its hook is {height_m:.3f} m above its top, but its gear is {rig.height_m:.3f} m high",
    )
    cell = np.array(component.target_vox) + np.array(component.hook_line_vox) + (0.5, 0.5, 0.0)
    at = np.array(component.lifting.points_m, np.float64).reshape(-1, 3) - site.frame.corner_of(cell)
    found = _pieces(rig, at)
    if isinstance(found, str):
        check.look(False, f"{name}: {found}")
        return
    most_rad = min(site.rules.sling_angle_rad / 2.0, _STEEPEST_RAD)
    load_kg = _check_below(check, name, component.mass_kg, rig, found, most_rad)
    _check_sling(check, name, parts[0], found[0], load_kg, most_rad)


def _pieces(rig: Rig, at: NDArray[np.float64]) -> tuple[_Legs, _Legs, float, float] | str:
    """Return the legs of the upper sling, those to the points, the span and the greater share; or what is wrong."""
    kinds = [part.kind for part in rig.parts]
    ends = (GearKind.SHACKLE, GearKind.ROUND_SLING)
    if len(kinds) == 2 and kinds[0] is GearKind.CHAIN_SLING and kinds[1] in ends:
        if rig.parts[0].legs != len(at) or rig.parts[0].count != 1 or rig.parts[1].count != len(at):
            return f"its gear has {rig.parts[0].legs} legs and {rig.parts[1].count} ends for {len(at)} lifting points"
        legs = _legs(at, (0.0, 0.0, rig.height_m))
        return "its hook is not above its lifting points" if legs is None else (legs, legs, 0.0, 1.0)
    if kinds[:3] != [GearKind.CHAIN_SLING, GearKind.SPREADER, GearKind.CHAIN_SLING] or kinds[3] not in ends:
        return "its gear is neither one sling nor a spreader between slings"
    counts = [part.count for part in rig.parts]
    if len(at) not in (2, 4) or counts != [1, 1, 2, len(at)] or rig.parts[2].legs * 2 != len(at):
        return f"a spreader with {counts} pieces of gear for {len(at)} lifting points"
    # Each point hangs with the nearest other one, if there are four.
    groups = [at[:1], at[1:]]
    if len(at) == 4:
        nearest = 1 + int(np.argmin(np.linalg.norm(at[1:, :2] - at[0, :2], axis=1)))
        groups = [at[[0, nearest]], np.delete(at, [0, nearest], axis=0)]
    middle = [group[:, :2].mean(axis=0) for group in groups]
    lower = [_legs(group, (*xy, rig.drop_m)) for group, xy in zip(groups, middle, strict=True)]
    upper = _legs(np.array([[*xy, rig.eye_m] for xy in middle]), (0.0, 0.0, rig.height_m))
    if upper is None or lower[0] is None or lower[1] is None or rig.eye_m < rig.drop_m:
        return "its spreader is not between its hook and its lifting points"
    out = [float(np.linalg.norm(xy)) for xy in middle]
    worse = max((one for one in lower if one is not None), key=lambda one: one.pull(1.0))
    return upper, worse, float(np.linalg.norm(middle[1] - middle[0])), max(out) / sum(out)


def _check_below(
    check: Check, name: str, mass_kg: float, rig: Rig, found: tuple[_Legs, _Legs, float, float], most_rad: float
) -> float:
    """Check everything below the upper sling, and return what hangs on that."""
    _, legs, span_m, share = found
    end = rig.parts[-1]
    pull_kg = legs.pull(mass_kg * share)
    may_kg = end.rated_kg * (_CHOKED if end.kind is GearKind.ROUND_SLING else 1.0)
    _check_load(check, name, end, pull_kg, may_kg)
    hung_kg = mass_kg + end.count * end.mass_kg
    if not span_m:
        return hung_kg
    spreader, lower = rig.parts[1:3]
    _check_sling(check, name, lower, legs, hung_kg * share, most_rad)
    hung_kg += lower.count * lower.mass_kg
    check.look(
        abs(spreader.length_m - span_m) <= _SAME_M,
        f"{name}: its spreader is {spreader.length_m:.2f} m long; its lifting points ask for {span_m:.2f} m",
    )
    _check_load(check, name, spreader, hung_kg, spreader.rated_kg)
    return hung_kg + spreader.mass_kg


def _check_sling(check: Check, name: str, sling: RigPart, legs: _Legs, load_kg: float, most_rad: float) -> None:
    """Check a sling: its legs as the points ask for, no flatter than the rules, long enough, and not overloaded."""
    steepest, longest_m = float(legs.angle_rad.max()), float(legs.length_m.max())
    check.look(
        sling.legs == len(legs.angle_rad) and sling.carrying == legs.carrying,
        f"{name}: its sling has {sling.carrying} of {sling.legs} legs carrying; "
        f"{legs.carrying} of {len(legs.angle_rad)} do",
    )
    check.look(
        abs(sling.angle_rad - steepest) <= _SAME_RAD,
        f"{name}: its legs lean by {degrees(steepest):.1f} degrees, not {degrees(sling.angle_rad):.1f}",
    )
    check.look(
        steepest <= most_rad + _SAME_RAD,
        f"{name}: its legs lean by {degrees(steepest):.1f} degrees; {degrees(most_rad):.1f} are allowed",
    )
    good = abs(sling.length_m - longest_m) <= _SAME_M and sling.made_m >= longest_m - _SAME_M
    check.look(
        good,
        f"{name}: a leg of its sling is {longest_m:.3f} m long; the gear says {sling.length_m:.3f} m, shortened from "
        f"{sling.made_m:g} m",
    )
    _check_load(check, name, sling, load_kg, legs.most(sling.rated_kg))


def _check_load(check: Check, name: str, part: RigPart, load_kg: float, may_kg: float) -> None:
    """Check that a piece carries what it says, may carry what it says, and does not carry more."""
    check.measure(load_kg / may_kg)
    check.look(
        load_kg <= may_kg * (1.0 + _SHARE),
        f"{name}: {part.name} carries {load_kg:.0f} kg; its working load limit is {may_kg:.0f} kg in this use",
    )
    check.look(
        _same(part.load_kg, load_kg) and _same(part.wll_kg, may_kg),
        f"{name}: {part.name} carries {load_kg:.1f} of {may_kg:.1f} kg, not {part.load_kg:.1f} of {part.wll_kg:.1f} kg",
    )


def _legs(points: NDArray[np.float64], from_m: tuple[float, float, float]) -> _Legs | None:
    """Return the legs from a point down to (N, 3) points; None if one of them does not go down."""
    away = np.array(from_m) - points
    lengths = np.array([sqrt(float(one @ one)) for one in away])
    if not len(points) or not np.isfinite(lengths).all() or (away[:, 2] <= 0.0).any():
        return None
    return _Legs(np.array([acos(min(1.0, z / m)) for z, m in zip(away[:, 2], lengths, strict=True)]), lengths)


def _same(one: float, other: float) -> bool:
    return abs(one - other) <= _SHARE * max(abs(one), abs(other)) + 1e-9


NEAR_M = 0.5
"""A lifting point is no further outside the box around its part than this and one cell."""
_ROUNDING_M = 1e-6
_ANCHORS = "anchors"
"""The points are of the model."""
_ASSUMED = "assumed"
"""The points were chosen with the gear."""
_HELD = "tandem"
"""The points are those at which two cranes hold it."""
_ABOVE = "centre_of_mass"
"""The model has no points: it hangs on one, on its top above its centre of mass."""


def check_slings(check: Check, site: Site, component: Component) -> None:
    """Check that lifting points lie on or near their part, and that its hook hangs as high as they need it."""
    points_m, rise = component.lifting.points_m, component.lifting.sling_rise_vox
    size_m, crane = site.frame.voxel_size_m, site.crane_of(component)
    low, high = component.mesh.bounds_m
    for point_m in points_m:
        off_m = float(np.maximum(low - point_m, point_m - high).max())
        at = ", ".join(f"{value:.3f}" for value in point_m)
        check.measure(max(off_m, 0.0))
        check.look(
            off_m <= NEAR_M + size_m, f"{component.id}: its lifting point ({at}) m is {off_m:.2f} m away from it"
        )
    wanted = fewest = 0
    cell = np.array(component.target_vox) + np.array(component.hook_line_vox) + (0.5, 0.5, 0.0)
    x, y, top_m = site.frame.corner_of(cell).tolist()
    source = component.lifting.source
    if source == _ABOVE:
        off_m = max((float(np.abs(np.subtract(point_m, (x, y, top_m))).max()) for point_m in points_m), default=0.0)
        good = len(points_m) <= 1 and off_m <= _SAME_M
        check.look(good, f"{component.id}: its lifting point is {off_m:.3f} m from its top above its centre of mass")
    elif component.tandem is not None:
        good = source == _HELD and points_m == component.tandem.points_m
        check.look(good, f"{component.id}: its lifting points are not where its two cranes hold it")
    else:
        good = source in ((_ANCHORS,) if component.lifting.rig is None else (_ANCHORS, _ASSUMED)) and len(points_m) > 0
        check.look(good, f"{component.id}: it hangs on {len(points_m)} points of the kind {source!r}")
    if source == _ANCHORS and crane is not None and points_m:
        slope = tan(site.rules.sling_angle_rad / 2.0)
        highest_m = max(point[2] + hypot(point[0] - x, point[1] - y) / slope for point in points_m)
        missing_m = highest_m - top_m - crane.sling_m
        wanted, fewest = (max(0, ceil((missing_m + off_m) / size_m)) for off_m in (_ROUNDING_M, -_ROUNDING_M))
    if component.lifting.rig is not None:
        return  # its height follows from its gear: see ``rigging``
    check.look(
        fewest <= rise <= wanted,
        f"{component.id}: its slings raise the hook by {rise} cells; its lifting points need {fewest}",
    )
