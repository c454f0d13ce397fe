"""Proves that a crane that moves is in one place at a time, by the motions, the moves and the triangles of the parts.

Its own definitions: a stay is a run of lifts, by time, that one set-up executes. Between two stays is a move, which the
crane pauses for. What stands at the end of a stay, and what existed before, meets neither carrier nor outriggers.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh
from bimvox.crane.tower_crane import TowerCrane
from bimvox.proof.clock import elapsed_ns
from bimvox.records.lift import Lift, LiftPlan
from bimvox.records.motion import LiftMotion
from bimvox.records.proof import Check
from bimvox.records.steps import Move, Pause, Steps

_ROUNDING_NS = 1_000
_SAME_M = 0.01
_TOUCHES_M = 0.01
"""A part may be this deep in the solid of the carrier: what it stands on ends where it begins."""
_OUTRIGGERS_M = 2.0
"""Height of outriggers, beams and pads above the foot, with the people beside them."""

_Floats = NDArray[np.float64]


def verify_set_ups(
    plan: LiftPlan, motions: Sequence[LiftMotion], steps: Steps, context: Collection[Lift] = ()
) -> Check:
    """Check the set-ups of a crane that moves.

    Args:
        plan: The plan.
        motions: Its motions.
        steps: The pauses and moves to prove.
        context: Lifts of the same plan that it does not carry: of an extract, the moves are not known.
    """
    check, site = Check("set_ups", unit="m"), plan.site
    moving, driven = site.moving, sorted(motions, key=lambda motion: (motion.start_ns, motion.order))
    if moving is None:
        check.look(not steps.moves, "moves of a crane that stays where it is")
        return check
    check.look(len(moving.names) == len(site.cranes), "there are not as many set-ups as places of the crane")
    for motion in driven:
        _check_lift(check, plan, motion)
    for one, other in pairwise(driven):
        check.about = site.components[other.component].id
        at_once = other.start_ns < one.end_ns
        check.look(
            not at_once or one.crane == other.crane,
            f"lift {other.number}: the crane would be in set-up {_name(plan, one.crane)} and in "
            f"{_name(plan, other.crane)} at once, at {other.start_ns / 1e9:.3f} s",
        )
        check.look(
            other.order > one.order, f"lift {other.number} is executed after lift {one.number}, against their order"
        )
    stays = list(_stays(driven))
    if not context:
        _check_moves(check, plan, stays, steps)
    for stay, then in zip(stays, [*stays[1:], None], strict=True):
        _check_stand(check, plan, stay, context)
        if not context:
            _check_left(check, plan, stay, None if then is None else then[0].order, steps)
    check.about = None
    return check


def _name(plan: LiftPlan, crane: int) -> str:
    names = () if plan.site.moving is None else plan.site.moving.names
    return repr(names[crane]) if 0 <= crane < len(names) else f"number {crane}"


def _stays(driven: Sequence[LiftMotion]) -> Iterator[list[LiftMotion]]:
    """Yield the runs of motions, by time, that one set-up executes."""
    run: list[LiftMotion] = []
    for motion in driven:
        if run and motion.crane != run[-1].crane:
            yield run
            run = []
        run.append(motion)
    if run:
        yield run


def _check_lift(check: Check, plan: LiftPlan, motion: LiftMotion) -> None:
    """Check that a lift is executed in the set-up of its part, and that its hook ends over the place from there."""
    site = plan.site
    part = site.components[motion.component]
    check.about, name = part.id, f"lift {motion.number} ({part.label})"
    check.look(
        motion.crane == part.crane,
        f"{name}: it is executed in set-up {_name(plan, motion.crane)}, its part is lifted in "
        f"{_name(plan, part.crane)}",
    )
    if not 0 <= motion.crane < len(site.cranes):
        return
    base, (slew_rad, radius_m, _) = site.cranes[motion.crane].base_m, motion.loaded.axes[-1].tolist()
    hook_m = np.array(base[:2]) + radius_m * np.array([np.cos(slew_rad), np.sin(slew_rad)])
    over = np.array(part.target_vox[:2]) + np.array(part.hook_line_vox[:2]) + 0.5
    place_m = np.array(site.frame.origin_m[:2]) + site.frame.voxel_size_m * over
    off_m = float(np.hypot(*(hook_m - place_m)))
    check.measure(off_m)
    check.look(
        off_m <= _SAME_M,
        f"{name}: from set-up {_name(plan, motion.crane)} its hook ends {off_m:.2f} m from its place",
    )


def _check_moves(check: Check, plan: LiftPlan, stays: Sequence[Sequence[LiftMotion]], steps: Steps) -> None:
    """Check that there is a move between two stays, and no other, and that it takes its time and fits in between."""
    wanted = [(then[0].order, before[0].crane, then[0].crane) for before, then in pairwise(stays)]
    given = [(move.order, move.come_from, move.goes_to) for move in steps.moves]
    check.about = None
    check.look(
        given == wanted,
        f"the crane changes its set-up before lifts {[order + 1 for order, *_ in wanted]}, but the moves are before "
        f"{[order + 1 for order, *_ in given]}, or of other set-ups",
    )
    if given == wanted:
        for move, (before, then) in zip(steps.moves, pairwise(stays), strict=True):
            check.about = plan.site.components[then[0].component].id
            _check_move(check, plan, move, steps.pauses, (before[-1].end_ns, then[0].start_ns))


def _check_move(check: Check, plan: LiftPlan, move: Move, pauses: Sequence[Pause], between_ns: tuple[int, int]) -> None:
    """Check one move; ``between_ns``: the end of the lift before and the start of the one after, on the clock."""
    moving, (one, other) = plan.site.moving, (plan.site.cranes[n] for n in (move.come_from, move.goes_to))
    assert moving is not None
    name = f"the move before lift {move.order + 1}"
    apart_m = float(np.hypot(other.base_m[0] - one.base_m[0], other.base_m[1] - one.base_m[1]))
    for what, spent_ns, asked_s in (
        ("to derig", move.drives_ns - move.begins_ns, moving.derig_s),
        (f"to drive {apart_m:.1f} m", move.arrives_ns - move.drives_ns, apart_m / moving.drive_m_s),
        ("to rig", move.ends_ns - move.arrives_ns, moving.rig_s),
    ):
        good = spent_ns >= asked_s * 1e9 - _ROUNDING_NS
        check.look(good, f"{name}: it takes {spent_ns / 1e9:.1f} s {what}, the site file asks for {asked_s:.1f} s")
    free_ns = elapsed_ns(pauses, between_ns[0])
    check.look(
        move.begins_ns >= free_ns - _ROUNDING_NS,
        f"{name}: it begins at {move.begins_ns / 1e9:.3f} s of elapsed time, before the lift before it ends, at "
        f"{free_ns / 1e9:.3f} s",
    )
    starts_ns = elapsed_ns(pauses, between_ns[1]) + sum(p.length_ns for p in pauses if p.at_ns == between_ns[1])
    check.look(
        move.ends_ns <= starts_ns + _ROUNDING_NS,
        f"{name}: it ends at {move.ends_ns / 1e9:.3f} s of elapsed time, after that lift begins, at "
        f"{starts_ns / 1e9:.3f} s",
    )


def _check_stand(check: Check, plan: LiftPlan, stay: Sequence[LiftMotion], context: Collection[Lift]) -> None:
    """Check that nothing that is set up to the last lift of a stay, or existed before, is where the crane stands."""
    site, number, until = plan.site, stay[0].crane, stay[-1].order
    if not 0 <= number < len(site.cranes):
        return
    crane = site.cranes[number]
    there = [(lift.component, lift.number) for lift in (*plan.lifts, *context) if lift.is_set and lift.order <= until]
    for index, order in sorted(there):
        part = site.components[index]
        check.about = part.id
        check.look(
            not meets_stand(crane, part.mesh),
            f"lift {order} ({part.label}): it is where the crane stands in set-up {_name(plan, number)}, which it "
            f"leaves after lift {stay[-1].number}",
        )
    check.about = None
    for blocker in site.blockers:
        if blocker.kind == "structure" and blocker.mesh is not None:
            name = blocker.name or blocker.id
            good = not meets_stand(crane, blocker.mesh)
            check.look(good, f"the crane stands in {name!r} in set-up {_name(plan, number)}")


def _check_left(check: Check, plan: LiftPlan, stay: Sequence[LiftMotion], until: int | None, steps: Steps) -> None:
    """Check that work where the crane stood begins when it has been derigged; ``until``: the order of the next stay."""
    site, last = plan.site, stay[-1]
    if site.moving is None or not 0 <= last.crane < len(site.cranes):
        return
    free_ns = elapsed_ns(steps.pauses, last.end_ns) + round(site.moving.derig_s * 1e9)
    for step in steps.steps:
        part = site.components[step.component]
        if step.order <= last.order or (until is not None and step.order >= until):
            continue
        if meets_stand(site.cranes[last.crane], part.mesh):
            check.about = part.id
            check.look(
                step.begins_ns >= free_ns - _ROUNDING_NS,
                f"lift {step.order + 1} ({part.label}): its work begins at {step.begins_ns / 1e9:.3f} s of elapsed "
                f"time, where the crane stands in set-up {_name(plan, last.crane)} until {free_ns / 1e9:.3f} s",
            )
    check.about = None


def meets_stand(crane: TowerCrane, mesh: TriangleMesh) -> bool:
    """Return whether a surface reaches into a mobile crane's carrier up to its pivot, or between its outriggers."""
    x, y, foot_m = crane.base_m
    half_m = crane.mast_size_m / 2.0
    top_m = foot_m + _OUTRIGGERS_M if crane.luffing is None else crane.luffing.pivot_height_m
    boxes = [(0.0, (-half_m, -half_m, half_m, half_m), top_m)]
    base = None if crane.carrier is None else crane.carrier.outriggers
    if crane.carrier is not None and base is not None:
        plan_m = (-base.rear_m, -base.right_m, base.front_m, base.left_m)
        boxes.append((crane.carrier.heading_rad, plan_m, foot_m + _OUTRIGGERS_M))
    low, high = mesh.bounds_m
    for turn_rad, (rear, right, front, left), most_m in boxes:
        far_m = float(np.hypot(max(-rear, front), max(-right, left)))
        if (low > [x + far_m, y + far_m, most_m]).any() or (high < [x - far_m, y - far_m, foot_m]).any():
            continue
        ahead, aside = np.cos(turn_rad), np.sin(turn_rad)
        to_carrier = np.array([[ahead, -aside, 0.0], [aside, ahead, 0.0], [0.0, 0.0, 1.0]])
        corners = (mesh.triangles_m - np.array([x, y, 0.0])) @ to_carrier
        box = np.array([[rear, right, foot_m], [front, left, most_m]]) + np.array([[1.0], [-1.0]]) * _TOUCHES_M
        if _meet_box(corners, box[0], box[1]).any():
            return True
    return False


def _meet_box(triangles: _Floats, low: _Floats, high: _Floats) -> NDArray[np.bool_]:
    """Return (N,) whether (N, 3, 3) triangles reach into a box, by the separating axes of both.

    The axes are those of the box, the triangle's normal, and the products of their edges.
    """
    middle, half = (low + high) / 2.0, (high - low) / 2.0
    corners = triangles - middle
    edges = np.roll(corners, -1, axis=1) - corners
    normal = np.cross(edges[:, 0], edges[:, 1])[:, None]
    crossed = np.cross(edges[:, :, None], np.eye(3)[None, None]).reshape(-1, 9, 3)
    axes = np.concatenate([np.broadcast_to(np.eye(3), (len(corners), 3, 3)), normal, crossed], axis=1)
    along = np.einsum("nad,ncd->nac", axes, corners)
    reach = np.abs(axes) @ half
    apart = (along.min(axis=2) >= reach) | (along.max(axis=2) <= -reach)
    # An axis without a length parts nothing.
    meets: NDArray[np.bool_] = ~(apart & (np.abs(axes).max(axis=2) > 1e-12)).any(axis=1)
    return meets
