"""The proof of a motion in the axes of the crane: clock, rates, ranges, ends, and capacity, which it reads itself."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise

import numpy as np
import shapely
from numpy.typing import NDArray

from bimvox.compiled import kernel
from bimvox.crane.kinematics import hook_of, joint_limits, joint_names, joints_of
from bimvox.crane.reach import LUFFING_HOOK_ROOM_M
from bimvox.crane.tower_crane import TowerCrane
from bimvox.grid.frame import GridFrame
from bimvox.proof.rigging import second_block_kg
from bimvox.records.motion import LiftMotion, PhaseName, Trajectory
from bimvox.records.proof import Check
from bimvox.site.site import Site
from bimvox.units import mass_text

_OVER_LIMIT = 1e-3
"""Share by which a rate, acceleration or jerk may exceed its limit: times are rounded to nanoseconds."""
_ROUNDING = 8.0 * np.finfo(np.float64).eps
_RANGE_M = 1e-6
_RANGE_RAD = 1e-6
_HOIST = 2

AXES = "slew_rad, radius_m and height_m"


def check_phases(check: Check, name: str, motion: LiftMotion) -> None:
    """Check that the phases follow each other in order without gaps, and that the trajectories fit into them.

    After a stop, the motion continues in any of the carrying phases.
    """
    phases = motion.phases
    order = {phase: n for n, phase in enumerate(PhaseName)}
    free = (
        {PhaseName.WAIT, PhaseName.APPROACH},
        {PhaseName.RELEASE, PhaseName.WAIT},
        {PhaseName.WAIT, PhaseName.LEAVE},
        *({carrying, PhaseName.TURN} for carrying in (PhaseName.HOIST, PhaseName.TRAVERSE, PhaseName.LOWER)),
    )
    names = [phase.name for phase in phases]
    check.look(
        bool(phases) and phases[0].start_ns == motion.start_ns and phases[-1].end_ns == motion.end_ns,
        f"{name}: its phases do not reach from its start to its end",
    )
    for one, other in pairwise(phases):
        check.look(
            one.end_ns == other.start_ns
            and (
                PhaseName.STOP in (one.name, other.name)
                or {one.name, other.name} in free
                or order[one.name] < order[other.name]
            ),
            f"{name}: {other.name} does not follow {one.name} at {one.end_ns / 1e9:.3f} s",
        )
    check.look(all(p.start_ns < p.end_ns for p in phases), f"{name}: a phase takes no time")
    spans = (
        ("approach", motion.approach, {PhaseName.APPROACH}, True),
        ("raising", motion.raising, {PhaseName.RAISE}, False),
        ("loaded motion", motion.loaded, {PhaseName.HOIST, PhaseName.TRAVERSE, PhaseName.LOWER}, True),
        # A stopped departure ends within the stop phase.
        ("departure", motion.departure, {PhaseName.LEAVE}, phases[-1].name is PhaseName.LEAVE),
    )
    check.look(
        (motion.approach is not None) == (PhaseName.APPROACH in names), f"{name}: approach and its phase do not agree"
    )
    if PhaseName.WAIT in names:
        _check_waits(check, name, motion)
    for what, part, wanted, to_its_end in spans:
        own = [phase for phase in phases if phase.name in wanted]
        if part is None or not len(part.time_ns):
            continue
        start_ns, end_ns = motion.start_ns + int(part.time_ns[0]), motion.start_ns + int(part.time_ns[-1])
        fits = bool(own) and start_ns == own[0].start_ns
        latest_ns = motion.end_ns if part is motion.departure else own[-1].end_ns if own else end_ns
        fits = fits and (end_ns == own[-1].end_ns if to_its_end else end_ns <= latest_ns)
        check.look(fits, f"{name}: its {what} does not fit its phases")


def _check_waits(check: Check, name: str, motion: LiftMotion) -> None:
    """Check that a crane waits with an empty hook and that no axis moves."""
    time_ns, axes = motion.samples()
    hooked_ns = motion.hooked_ns
    for phase in motion.phases:
        if phase.name is not PhaseName.WAIT:
            continue
        ends = np.array([phase.start_ns, phase.end_ns])
        at_ends = [np.interp(ends, time_ns, axis) for axis in axes.T]
        inside = axes[(time_ns >= phase.start_ns) & (time_ns <= phase.end_ns)]
        still = all(
            np.ptp(np.concatenate([two, axis])) <= _RANGE_RAD for two, axis in zip(at_ends, inside.T, strict=True)
        )
        check.look(still, f"{name}: it waits at {phase.start_ns / 1e9:.3f} s, and moves")
        check.look(
            phase.end_ns <= hooked_ns or phase.start_ns >= motion.released_ns,
            f"{name}: it waits at {phase.start_ns / 1e9:.3f} s with its load",
        )


def check_limits(check: Check, name: str, crane: TowerCrane, motion: LiftMotion, mass_kg: float) -> None:
    """Check rate, acceleration and jerk of every axis by divided differences of the samples.

    The limit of the hoist depends on the hung mass: none during the approach, the load afterwards. Between two
    samples over a slow zone, every rate limit is multiplied by the share of the zone.

    The k-th divided difference times k! is a value or an average of the k-th derivative between the samples. So a
    motion within its limits passes for any choice of samples.
    """
    time_ns, axes = motion.samples()
    time_s = (time_ns - time_ns[0]) / 1e9
    empty_ns = 0 if motion.approach is None else int(motion.approach.time_ns[-1])
    is_empty = time_ns[1:] - time_ns[0] <= empty_ns
    if motion.departure is not None:
        is_empty |= time_ns[:-1] - time_ns[0] >= int(motion.departure.time_ns[0])
    hoist_rate = np.where(is_empty, _hoist_rate(crane, 0.0), _hoist_rate(crane, mass_kg))
    slow = _slow_between(crane, axes)
    names, joints = joint_names(crane), joints_of(crane, axes)
    for axis, limits in enumerate(joint_limits(crane)):
        values = np.ascontiguousarray(joints[:, axis])
        noise = np.full(len(values), _ROUNDING * (float(np.abs(values).max()) + crane.jib_height_m))
        for order, (what, limit) in enumerate(
            (("rate", limits.rate), ("acceleration", limits.acceleration), ("jerk", limits.jerk)), start=1
        ):
            if len(values) < 2:
                break
            rate = hoist_rate if axis == _HOIST else np.full(len(slow), limit)
            allowed = slow * rate if order == 1 else np.full(len(values) - 1, limit)
            values, noise, worst, share = _differences(time_s, values, noise, allowed, order)
            check.measure(share)
            check.look(
                share <= 1.0 + _OVER_LIMIT,
                f"{name}: {names[axis]} {what} {abs(values[worst]):.4g} at {time_s[worst]:.2f} s, "
                f"allowed {allowed[worst]:.4g}",
                samples=len(values),
            )


@kernel
def _differences(
    time_s: NDArray[np.float64],
    values: NDArray[np.float64],
    noise: NDArray[np.float64],
    allowed: NDArray[np.float64],
    order: int,
) -> tuple[NDArray[np.float64], NDArray[np.float64], int, float]:
    """Return divided differences times their order, their noise, the worst index and its share of the limit."""
    count = len(values) - 1
    differences, noises = np.empty(count), np.empty(count)
    worst, largest = 0, -1.0
    for n in range(count):
        span_s = (time_s[n + order] - time_s[n]) / order
        differences[n] = (values[n + 1] - values[n]) / span_s
        noises[n] = (noise[n + 1] + noise[n]) / span_s
        excess = max(abs(differences[n]) - noises[n], 0.0)
        share = excess / allowed[n] if allowed[n] > 0.0 else np.inf
        if largest == largest and not share <= largest:  # NaN counts as the worst value and propagates
            worst, largest = n, share
    return differences, noises, worst, largest


def _hoist_rate(crane: TowerCrane, load_kg: float) -> float:
    """Return the rate of the fastest gear that can hoist a load, searched from the heaviest gear down."""
    hung_kg = load_kg + crane.hook_block_kg + crane.rigging_mass_kg
    rate = min([joint_limits(crane)[_HOIST].rate] + [last for _, last in crane.gears[-1:]])
    for most_kg, faster in reversed(crane.gears):
        if hung_kg > most_kg:
            break
        rate = faster
    return rate


def _slow_between(crane: TowerCrane, axes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (N - 1,) allowed share of the rates between samples: reduced if both samples are over a slow zone."""
    allowed = np.ones(len(axes) - 1)
    hook_m = hook_of(crane, *axes.T)
    for zone in crane.slow_zones:
        over = shapely.contains_xy(shapely.Polygon(zone.polygon), hook_m[:, 0], hook_m[:, 1])
        allowed = np.where(over[:-1] & over[1:], np.minimum(allowed, zone.share), allowed)
    return allowed


def check_rests(check: Check, name: str, crane: TowerCrane, trajectory: Trajectory, what: str) -> None:
    """Check that the axes are at rest at both ends of a trajectory and at its corners.

    From rest, an axis moves at most a t^2 / 2 and j t^3 / 6 within time t.
    """
    time_s, axes = trajectory.time_ns / 1e9, joints_of(crane, trajectory.axes)
    limits, names = joint_limits(crane), joint_names(crane)
    most = np.array([limit.acceleration for limit in limits]), np.array([limit.jerk for limit in limits])
    noise = _ROUNDING * (np.abs(axes).max(axis=0) + crane.jib_height_m)
    inner = trajectory.corner[(trajectory.corner > 0) & (trajectory.corner < len(time_s) - 1)]
    steps = [(0, 1), (len(time_s) - 1, len(time_s) - 2), *((i, i + 1) for i in inner), *((i, i - 1) for i in inner)]
    for at, beside in steps:
        span_s = abs(float(time_s[beside] - time_s[at]))
        reach = np.minimum(most[0] * span_s**2 / 2.0, most[1] * span_s**3 / 6.0) * (1.0 + _OVER_LIMIT) + 2.0 * noise
        gone = np.abs(axes[beside] - axes[at])
        axis = int(np.argmax(gone - reach))
        check.look(
            bool(gone[axis] <= reach[axis]),
            f"{name}: {names[axis]} is not at rest at {time_s[at]:.2f} s of its {what}",
        )


def check_range(check: Check, name: str, crane: TowerCrane, axes: NDArray[np.float64], frame: GridFrame) -> None:
    """Check that the hook is between the smallest radius and the jib's end, the end of its slings above all ground.

    In its middle, a straight unit move between two columns at the smallest radius r is nearer to the mast by
    h^2 / (8 r) for cells of size h. The check allows for this.
    """
    nearest_m = np.sqrt(max(crane.min_radius_m**2 - (frame.voxel_size_m / 2.0) ** 2, 0.0))
    lowest_m = frame.origin_m[2] + frame.voxel_size_m + crane.sling_m
    given = crane.working_range
    near_m, far_m = given.radius_m or (0.0, np.inf)
    nearest_m, furthest_m = max(nearest_m, near_m), min(crane.jib_length_m, far_m)
    highest_m = min(crane.jib_height_m, np.inf if given.highest_hook_m is None else given.highest_hook_m)
    lowest = np.array([nearest_m, lowest_m]) - _RANGE_M
    highest = np.array([furthest_m, highest_m]) + _RANGE_M
    bad = ((axes[:, 1:] < lowest) | (axes[:, 1:] > highest)).any(axis=1)
    worst = axes[bad][:1, 1:].ravel()
    where = f"radius {worst[0]:.3f} m, height {worst[1]:.3f} m" if bad.any() else ""
    check.look(
        not bad.any(),
        f"{name}: the hook is at {where}; allowed are radii {nearest_m:g} to {furthest_m:g} m, "
        f"heights {lowest_m:g} to {highest_m:g} m",
        samples=len(axes),
    )
    if crane.luffing is not None:
        rope_m = joints_of(crane, axes)[:, _HOIST]
        short = int(np.argmin(rope_m))
        check.look(
            bool(rope_m[short] >= LUFFING_HOOK_ROOM_M - _RANGE_M),
            f"{name}: the hook is {rope_m[short]:.3f} m below the jib's tip; {LUFFING_HOOK_ROOM_M:g} m are needed",
            samples=len(axes),
        )
    if given.slew_rad is not None:
        first, last = given.slew_rad
        turned = np.remainder(axes[:, 0] - (first + last) / 2.0 + np.pi, 2.0 * np.pi) - np.pi
        out = np.abs(turned) > (last - first) / 2.0 + _RANGE_RAD
        worst_rad = float(axes[int(np.argmax(out)), 0])
        check.look(
            not out.any(),
            f"{name}: the jib is at {worst_rad:.4f} rad; its limiter is set to {first:g} to {last:g} rad",
            samples=len(axes),
        )


def check_capacity(
    check: Check, name: str, crane: TowerCrane, trajectory: Trajectory, mass_kg: float, most_used: float = 1.0
) -> None:
    """Check that load, rigging and hook block together use no more of the capacity than is permitted, at every sample.

    Args:
        check: The check.
        name: The lift and its part.
        crane: The crane.
        trajectory: The motion.
        mass_kg: Mass of the load; 0 for the empty hook.
        most_used: Highest permitted share of the capacity of the load chart.
    """
    hung_kg = mass_kg + crane.rigging_mass_kg + crane.hook_block_kg + second_block_kg(crane)
    used = shares_of_capacity(crane, trajectory.slew_rad, trajectory.radius_m, hung_kg)
    worst = int(np.argmax(used))
    check.measure(float(used[worst]))
    check.look(
        bool(used[worst] <= most_used + 1e-9),
        f"{name}: {mass_text(hung_kg)} at {trajectory.radius_m[worst]:.2f} m is {used[worst]:.3f} of the capacity"
        + ("" if most_used == 1.0 else f", {most_used:g} is permitted"),
        samples=len(used),
    )


def most_permitted(site: Site, ends: Iterable[float]) -> float:
    """Return the share of the capacity that a load may use: the rule's or, if that gives way, that of its ends.

    ``ends``: the shares that it uses where it is picked and where it is set.
    """
    most = site.rules.highest_utilisation
    return min(1.0, max([most, *ends])) if "highest_utilisation" in site.rules.gives_way else most


def shares_of_capacity(
    crane: TowerCrane, slew_rad: NDArray[np.float64], radius_m: NDArray[np.float64], hung_kg: float
) -> NDArray[np.float64]:
    """Return (N,) the utilisation of the capacity by a mass at slewing angles and radii; infinite beyond the chart.

    Within a sector of a mobile crane, its chart holds, elsewhere that of the crane.
    """
    used = _shares_of_chart(crane.chart.radius_m, crane.chart.capacity_kg, radius_m, hung_kg)
    if crane.carrier is None:
        return used
    for sector in crane.carrier.sectors:
        # Inside: to the left of the first line and to the right of the last, measured from the first one.
        turned = np.remainder(slew_rad - crane.carrier.heading_rad - sector.from_rad, 2.0 * np.pi)
        inside = (turned > _ON_LINE_RAD) & (turned < sector.to_rad - sector.from_rad - _ON_LINE_RAD)
        inside |= sector.to_rad - sector.from_rad > 2.0 * np.pi - _ON_LINE_RAD
        if sector.chart is None:
            used[inside] = np.inf
        else:
            listed = (sector.chart.radius_m, sector.chart.capacity_kg)
            used[inside] = _shares_of_chart(*listed, radius_m[inside], hung_kg)
    return used


def _shares_of_chart(
    at_m: Sequence[float], capacity_kg: Sequence[float], radius_m: NDArray[np.float64], hung_kg: float
) -> NDArray[np.float64]:
    """Return (N,) the utilisation of a chart as it is listed: a load counts at the next listed radius."""
    used = np.full(len(radius_m), np.inf)
    # From the end of the chart inwards, each listed radius takes over what does not reach beyond it.
    for listed_m, carries_kg in reversed(list(zip(at_m, capacity_kg, strict=True))):
        used[radius_m <= listed_m + _ROUNDED_M] = hung_kg / carries_kg
    return used


_ROUNDED_M = 1e-6
"""By how much rounding may move a radius beyond a listed one."""
_ON_LINE_RAD = 1e-9
"""Within this of the line between two sectors, the crane's own chart holds."""
