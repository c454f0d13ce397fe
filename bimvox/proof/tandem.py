"""The proof that two cranes may carry a part together: shares, load charts, one course of both hooks, no other lift.

Each crane sees the part hang on its own hook alone, at its own point and with the mass that the balance of forces and
of moments puts there while the part is turned by the permitted angle, as a rigid body, to either side. So all that is
proven about one hook is proven about each of the two. Nothing is taken from the planner but the two lifting points.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.kinematics import hook_of
from bimvox.kept import kept
from bimvox.proof.crane.axes import shares_of_capacity
from bimvox.proof.flip import centre_of_mass
from bimvox.proof.rigging import rigging_kg, second_block_kg
from bimvox.records.lift import Lift
from bimvox.records.motion import LiftMotion, PhaseName
from bimvox.records.proof import Check
from bimvox.records.tandem import SharedLoad
from bimvox.site.component import Component, Lifting, StoredPose
from bimvox.site.site import Site

TANDEM, TOGETHER = "tandem", "together"
"""The checks of parts that two cranes carry: what the plan says of them, and their motions."""

_SAME_M = 2e-3
_APART_M = 1e-2
"""How far the two hooks may be from their distance, between samples too: their ropes lean by no more than that."""
_SAME_SHARE = 5e-3
_SAME_MASS = 1e-3
_SAME_RAD = 1e-6
_SLACK = 1e-6


def has_tandems(site: Site) -> bool:
    """Return whether two cranes carry a part of a site together."""
    return any(part.tandem is not None for part in site.components)


@kept
def as_crane_sees(site: Site, crane: int) -> Site:
    """Return a site in which a crane alone holds its share of the parts that it carries with another one."""
    return replace(site, components=tuple(_half(site, part, crane) for part in site.components))


def _half(site: Site, part: Component, crane: int) -> Component:
    tandem, rules = part.tandem, site.rules.tandem
    own = [] if tandem is None else [n for n, one in enumerate((part.crane, tandem.second)) if one == crane]
    if tandem is None or rules is None or not own:
        return part
    point_m, level = tandem.points_m[own[0]], shares(part, 0.0)[own[0]]
    at = (np.array(point_m[:2]) - site.frame.corner_of(part.target_vox)[:2]) / site.frame.voxel_size_m
    column = np.floor(at + 1e-9).astype(int)
    aside = at - column - 0.5
    return replace(
        part,
        crane=crane,
        tandem=None,
        mass_kg=part.mass_kg
        * max(shares(part, angle)[own[0]] for angle in (-rules.off_level_rad, rules.off_level_rad)),
        hook_offset_vox=(int(column[0]), int(column[1]), part.hook_offset_vox[2]),
        hook_aside_vox=(float(aside[0]), float(aside[1])),
        lifting=Lifting((point_m,), TANDEM),
        sail_area_m2=part.sail_area_m2 * level,
    )


def shares(part: Component, angle_rad: float) -> tuple[float, float]:
    """Return the share of the mass on each hook of a part that is turned by an angle, its second point up."""
    assert part.tandem is not None
    first, second = (np.array(point) for point in part.tandem.points_m)
    along = (second - first)[:2] / max(float(np.hypot(*(second - first)[:2])), 1e-9)
    to_m = np.array([*((centre_of_mass(part) - first)[:2] @ along,), centre_of_mass(part)[2] - first[2]])
    span_m = np.array([float((second - first)[:2] @ along), float(second[2] - first[2])])
    level = np.array([np.cos(angle_rad), -np.sin(angle_rad)])
    # Moments about the first point: the second rope bears the weight at the centre of mass.
    whole_m = float(span_m @ level)
    on_second = float(to_m @ level) / whole_m if abs(whole_m) > 1e-9 else np.inf
    return 1.0 - on_second, on_second


def check_tandem(check: Check, site: Site, lift: Lift, part: Component) -> None:
    """Check what a lift says of two cranes that carry its part; one that a crane carries alone says nothing."""
    name, shared, rules = part.id, lift.tandem, site.rules.tandem
    if part.tandem is None:
        check.look(shared is None, f"{name}: states shares of two cranes, but one carries it")
        return
    check.look(shared is not None, f"{name}: two cranes carry it, but their shares are not stated")
    check.look(rules is not None, f"{name}: two cranes carry it, but the rules say nothing about that")
    cranes = (part.crane, part.tandem.second)
    two = site.moving is None and len(set(cranes)) == 2 and all(0 <= one < len(site.cranes) for one in cranes)
    check.look(two, f"{name}: is carried by two cranes, of a site with two that stand there at the same time")
    if shared is None or rules is None or not two:
        return
    check.look(
        shared.cranes == cranes and shared.points_m == part.tandem.points_m,
        f"{name}: states other cranes or lifting points than those of the part",
    )
    _check_hung(check, lift, name)
    _check_points(check, site, part)
    _check_shares(check, part, shared, rules.off_level_rad)
    _check_charts(check, site, lift, part, shared)


def _check_hung(check: Check, lift: Lift, name: str) -> None:
    """Check that a part is carried as it is set: neither lying, turned nor guided, and without a stop."""
    place = lift.place
    as_set = place is not None and place.pose is StoredPose.AS_BUILT and not (place.turn or place.stack or place.rack)
    as_set = as_set and not (lift.ever_with_jib or lift.guide or lift.flip or lift.left)
    check.look(as_set, f"{name}: two cranes carry a part only as it is set: neither lying, turned, stacked nor guided")


def _check_points(check: Check, site: Site, part: Component) -> None:
    """Check that the lifting points are on top of the part, with its centre of mass between them and on their line."""
    assert part.tandem is not None
    top_m, size_m = float(part.mesh.vertices_m[:, 2].max()), site.frame.voxel_size_m
    first, second = (np.array(point) for point in part.tandem.points_m)
    columns = {tuple(column) for column in (part.shape.cells[:, :2] + np.array(part.target_vox[:2])).tolist()}
    for point in (first, second):
        cell = np.floor((point[:2] - np.array(site.frame.origin_m[:2])) / size_m + 1e-9).astype(int)
        on_top = abs(float(point[2]) - top_m) <= _SAME_M and tuple(cell.tolist()) in columns
        at = ", ".join(f"{value:.3f}" for value in point)
        check.look(on_top, f"{part.id}: its lifting point ({at}) m is not on its top")
    span_m = float(np.hypot(*(second - first)[:2]))
    along = (second - first)[:2] / max(span_m, 1e-9)
    to_centre = (centre_of_mass(part) - first)[:2]
    on_way_m, off_m = float(to_centre @ along), abs(float(to_centre[0] * along[1] - to_centre[1] * along[0]))
    check.look(
        off_m <= _SAME_M and 0.0 < on_way_m < span_m,
        f"{part.id}: its centre of mass is {off_m:.3f} m off the line between its two lifting points, or beyond them",
    )


def _check_shares(check: Check, part: Component, shared: SharedLoad, off_level_rad: float) -> None:
    slack_kg = _SAME_MASS * part.mass_kg
    check.look(
        abs(sum(shared.load_kg) - part.mass_kg) <= slack_kg,
        f"{part.id}: its two cranes carry {sum(shared.load_kg) / 1000.0:.3f} t together, but it weighs "
        f"{part.mass_kg / 1000.0:.3f} t",
    )
    check.look(
        abs(shared.off_level_rad - off_level_rad) <= _SAME_RAD,
        f"{part.id}: is carried out of level by up to {np.degrees(shared.off_level_rad):.1f} degrees, the rules say "
        f"{np.degrees(off_level_rad):.1f}",
    )
    level = shares(part, 0.0)
    most = np.max([shares(part, angle) for angle in (-off_level_rad, off_level_rad)], axis=0)
    for n, crane in enumerate(("first", "second")):
        for what, stated_kg, share in (
            ("level", shared.load_kg[n], level[n]),
            ("out of level", shared.most_kg[n], most[n]),
        ):
            wanted_kg = part.mass_kg * float(share)
            check.look(
                abs(stated_kg - wanted_kg) <= slack_kg,
                f"{part.id}: {what}, its {crane} crane carries {wanted_kg / 1000.0:.3f} t, not "
                f"{stated_kg / 1000.0:.3f} t",
            )
    apart_m = float(np.hypot(*np.subtract(*shared.points_m)[:2]))
    check.look(
        abs(shared.apart_m - apart_m) <= _SAME_M,
        f"{part.id}: its lifting points are {apart_m:.3f} m apart, not {shared.apart_m:.3f} m",
    )


def _check_charts(check: Check, site: Site, lift: Lift, part: Component, shared: SharedLoad) -> None:
    assert lift.path_vox is not None
    assert site.rules.tandem is not None
    limit = site.rules.tandem.most_share
    for n, number in enumerate(shared.cranes):
        crane, half = site.cranes[number], _half(site, part, number)
        line = lift.path_vox[:, :2] + np.array(half.hook_line_vox[:2]) + 0.5
        at_m = np.array(site.frame.origin_m[:2]) + site.frame.voxel_size_m * line - np.array(crane.base_m[:2])
        radius_m, slew_rad = np.hypot(*at_m.T), np.arctan2(at_m[:, 1], at_m[:, 0])
        used = float(shares_of_capacity(crane, slew_rad, radius_m, _hung_kg(site, half)).max())
        check.measure(used)
        check.look(
            used <= limit + _SLACK,
            f"{part.id}: carried by two cranes, it uses {100.0 * used:.1f} % of the load chart of {crane.name}; "
            f"{100.0 * limit:g} % is permitted",
        )
        good = abs(used - shared.used[n]) <= _SAME_SHARE and abs(float(radius_m.max()) - shared.radius_m[n]) <= _SAME_M
        check.look(
            good,
            f"{part.id}: it uses {100.0 * used:.1f} % of the load chart of {crane.name} at up to "
            f"{radius_m.max():.2f} m, not {100.0 * shared.used[n]:.1f} % at {shared.radius_m[n]:.2f} m",
        )


def _hung_kg(site: Site, half: Component) -> float:
    crane = site.cranes[half.crane]
    return half.mass_kg + rigging_kg(crane, half) + crane.hook_block_kg + second_block_kg(crane)


def check_together(check: Check, site: Site, lift: Lift, motion: LiftMotion, others: Sequence[LiftMotion]) -> None:
    """Check that two cranes carry a part in one course, and that no other part is lifted meanwhile.

    ``others``: the motions of all other lifts.
    """
    part = site.components[lift.component]
    name, second, check.about = f"lift {lift.number} ({part.label})", motion.second, part.id
    if part.tandem is None:
        check.look(second is None, f"{name}: two cranes move for it, but one carries it")
        return
    if second is None:
        check.look(False, f"{name}: two cranes carry it, but only one has a motion")
        return
    good = (second.order, second.component, second.crane) == (motion.order, motion.component, part.tandem.second)
    check.look(good and second.second is None, f"{name}: the motion of its second crane is of another lift or crane")
    own, other = (_steps(one) for one in (motion, second))
    check.look(own == other, f"{name}: its two cranes do not hook on, carry, set and release it at the same times")
    _check_course(check, name, site, part, motion, second)
    limit = 1.0 if site.rules.tandem is None else site.rules.tandem.most_share
    for one in (motion, second):
        if not 0 <= one.crane < len(site.cranes):
            continue
        crane, half = site.cranes[one.crane], _half(site, part, one.crane)
        for way in (one.raising, one.loaded):
            used = float(shares_of_capacity(crane, way.slew_rad, way.radius_m, _hung_kg(site, half)).max())
            check.measure(used)
            check.look(
                used <= limit + _SLACK,
                f"{name}: on its way it uses {100.0 * used:.1f} % of the load chart of {crane.name}; "
                f"{100.0 * limit:g} % is permitted",
            )
    begins_ns, ends_ns = _span_ns(motion)
    met = [one.number for one in others if _span_ns(one)[0] < ends_ns and _span_ns(one)[1] > begins_ns]
    check.look(not met, f"{name}: while two cranes carry it, lift {met[0] if met else 0} goes on")


def _steps(motion: LiftMotion) -> list[tuple[PhaseName, int, int]]:
    """Return the phases in which the part is on the hook."""
    empty = (PhaseName.APPROACH, PhaseName.WAIT, PhaseName.LEAVE)
    return [(one.name, one.start_ns, one.end_ns) for one in motion.phases if one.name not in empty]


def _span_ns(motion: LiftMotion) -> tuple[int, int]:
    steps = _steps(motion)
    return (steps[0][1], steps[-1][2]) if steps else (motion.start_ns, motion.end_ns)


def _check_course(check: Check, name: str, site: Site, part: Component, motion: LiftMotion, second: LiftMotion) -> None:
    """Check that both hooks are as far apart as the lifting points, in every direction, at all samples and between."""
    assert part.tandem is not None
    if not all(0 <= one.crane < len(site.cranes) for one in (motion, second)):
        return
    wanted_m = np.subtract(part.tandem.points_m[1], part.tandem.points_m[0])
    for what, one, other in (("raised", motion.raising, second.raising), ("carried", motion.loaded, second.loaded)):
        times = [way.time_ns + owner.start_ns for way, owner in ((one, motion), (other, second))]
        check.look(
            times[0][0] == times[1][0] and times[0][-1] == times[1][-1],
            f"{name}: its two cranes do not begin and end at the same times while it is {what}",
        )
        at_ns = np.unique(np.concatenate(times))
        at_ns = np.unique(np.concatenate([at_ns, (at_ns[:-1] + at_ns[1:]) // 2]))
        ends_m = [
            _slings_end_m(site, owner.crane, [np.interp(at_ns, own_ns, axis) for axis in way.axes.T])
            for own_ns, way, owner in ((times[0], one, motion), (times[1], other, second))
        ]
        off_m = np.linalg.norm(ends_m[1] - ends_m[0] - wanted_m, axis=1)
        worst = int(np.argmax(off_m))
        check.look(
            bool(off_m[worst] <= _APART_M),
            f"{name}: at {at_ns[worst] / 1e9:.2f} s, {what}, its hooks are {off_m[worst]:.3f} m from where both hang "
            "above their lifting points",
            samples=len(at_ns),
        )


def _slings_end_m(site: Site, number: int, axes: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Return (N, 3) the lower end of the slings of a crane."""
    crane = site.cranes[number]
    ends_m: NDArray[np.float64] = hook_of(crane, *axes) - np.array([0.0, 0.0, crane.sling_m])
    return ends_m
