"""The proof of how a load is held: guided last moves, tilted and aside, and its heading, which a crew turns in time."""

from __future__ import annotations

from collections.abc import Sequence
from math import pi

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.tower_crane import TowerCrane
from bimvox.kept import kept
from bimvox.proof.bodies.triangles import TriangleCheck
from bimvox.proof.moment import NO_SOLID, Thing, beside, near_and_far
from bimvox.proof.space import BETWEEN_VOX, SPACING_VOX, reference_cells
from bimvox.records.lift import (
    ASIDE_RATE_M_S,
    MOST_ASIDE_M,
    MOST_FORCE_N,
    MOST_TILT_RAD,
    TILT_RATE_RAD_S,
    Guide,
    Lift,
    side_force_n,
    swept_box_m,
)
from bimvox.records.motion import LiftMotion, PhaseName
from bimvox.records.proof import Check
from bimvox.site.component import Component
from bimvox.site.lifting import crane_for
from bimvox.site.parts import centre_of_mass_m
from bimvox.site.site import HeadingRule, Site

_SAME_M = 1e-3
_CENTRE_M = 0.01
_SLACK = 1e-9
_FASTER = 1.001
_IN_LINE_VOX = 0.01


def check_guide(
    check: Check, triangles: TriangleCheck, site: Site, lift: Lift, component: Component, present: Sequence[Thing]
) -> None:
    """Check the poses of a guided load: that people can hold it so, and that it meets nothing."""
    guide = lift.guide
    assert guide is not None
    fault = _fault(site, lift, component, guide)
    check.look(fault is None, f"{component.id}: guided to its place, {fault}")
    if fault is not None:
        return
    near, far = near_and_far(component, present)
    low, high = guided_box_vox(site, component, guide)
    check.look(bool((low >= 0).all() and (high < site.shape).all()), f"{component.id}: guided, it leaves the site")
    for thing in beside(far, low.tolist(), high.tolist()):
        if thing.solid != NO_SOLID:
            triangles.check_guided(check, component, guide, thing.solid, is_near=False)
    for thing in near:
        triangles.check_guided(check, component, guide, thing.solid, is_near=True)
    for name in in_the_box(present, low, high):
        check.look(False, f"{component.id}: guided to its place, it comes into cells near {name}")


def guided_box_vox(site: Site, component: Component, guide: Guide) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the lowest and the highest cell of the box that a guided part sweeps, both inclusive."""
    tolerance_m = site.rules.contact_tolerance_m
    low_m, high_m = swept_box_m(component.mesh.vertices_m, guide)
    first, last = site.frame.cells_over(low_m + tolerance_m, high_m - tolerance_m)
    return first, last - 1


def in_the_box(things: Sequence[Thing], low: NDArray[np.int64], high: NDArray[np.int64]) -> list[str]:
    """Return the names of the things without triangles that have a cell in a box, both ends inclusive."""
    close = [thing for thing in beside(things, low.tolist(), high.tolist()) if thing.solid == NO_SOLID]
    return [thing.name for thing in close if ((thing.cells >= low) & (thing.cells <= high)).all(axis=1).any()]


def check_guiding(
    check: Check, name: str, guide: Guide, cells: NDArray[np.float64], time_s: NDArray[np.float64], voxel_size_m: float
) -> None:
    """Check that a load goes straight down while it is guided, and no faster than a crew can guide it.

    Args:
        check: Receives the result.
        name: The lift, for messages.
        guide: Its poses.
        cells: (N, 3) reference cells of the load on its last moves.
        time_s: (N,) their times.
        voxel_size_m: Edge of a cell.
    """
    height_m = (cells[:, 2] - cells[-1, 2]) * voxel_size_m
    begins = int(np.argmax(height_m < guide.top_m))
    cells, time_s, poses = cells[begins:], time_s[begins:], guide.at(height_m[begins:])
    aside = np.abs(cells[:, :2] - cells[-1, :2]).max(initial=0.0)
    check.look(bool(aside <= _IN_LINE_VOX), f"{name}: its hook does not go straight down while the load is guided")
    moves, spans_s = np.abs(np.diff(poses, axis=0)), np.diff(time_s)
    for n, (most, what) in enumerate(((ASIDE_RATE_M_S, "aside"), (TILT_RATE_RAD_S, "to a tilt"))):
        bad = np.flatnonzero(moves[:, n] > most * _FASTER * spans_s + _SLACK)
        at = "" if not len(bad) else f" at {time_s[bad[0]]:.2f} s"
        check.look(not len(bad), f"{name}: its load is guided {what} faster than a crew can{at}", samples=len(moves))


def _fault(site: Site, lift: Lift, component: Component, guide: Guide) -> str | None:
    """Return why a crew cannot guide a load so, or None."""
    poses, path = np.array(guide.poses, np.float64).reshape(-1, 3), lift.path_vox
    numbers = np.array([*poses.ravel(), guide.heading_rad, *guide.centre_m])
    if path is None or len(poses) < 2 or not np.isfinite(numbers).all():
        return "its poses are not numbers"
    if (np.diff(poses[:, 0]) >= 0.0).any() or poses[-1].any() or poses[0, 1:].any():
        return "it does not come down from level above its place to its place"
    if abs(poses[0, 0] - lift.contact_moves * site.frame.voxel_size_m) > _SAME_M:
        return "its poses do not begin where its last moves do"
    if (path[len(path) - 1 - lift.contact_moves :, :2] != path[-1, :2]).any():
        return "its last moves do not lead straight down"
    if guide.steepest_rad > MOST_TILT_RAD + _SLACK:
        return f"it is tilted by {np.degrees(guide.steepest_rad):.1f} degrees; {np.degrees(MOST_TILT_RAD):.1f} at most"
    if guide.furthest_m > MOST_ASIDE_M + _SLACK:
        return f"it is held {guide.furthest_m:.2f} m aside; {MOST_ASIDE_M:g} m at most"
    crane = site.crane_of(component)
    if crane is None or site.has_several_cranes:
        return "on a site that does not have exactly one crane"
    centre_m = centre_of_mass_m(component.mesh)
    if centre_m is None or np.abs(centre_m - guide.centre_m).max() > _CENTRE_M:
        return "it is not tilted about its centre of mass"
    top_m = site.frame.corner_of(np.array(component.target_vox) + np.array(component.hook_offset_vox))[2]
    rope_m = crane.jib_height_m - top_m - crane_for(site, crane, component).sling_m
    force_n = side_force_n(component.mass_kg, guide.furthest_m, rope_m)
    if force_n > MOST_FORCE_N * (1.0 + 1e-6):
        return f"it is held {guide.furthest_m:.2f} m aside with {force_n:.0f} N; {MOST_FORCE_N:g} N at most"
    return None


# The proof of the heading of a load: where it may be any, and that a crew has the time to turn it to the final one.
#
# Of a load that turns with the jib, the heading is not followed: from the first slewing until it is turned to its final
# heading it must be free at every heading, as a cylinder about its hook line.

_STILL_RAD = 1e-9
_SAME = 1e-6
"""An angle, rad, or a way of the hook, m, that is smaller is none."""
_SAME_VOX = 0.01
_ROUNDED_NS = 2


@kept
def cells_at_any_heading(component: Component) -> NDArray[np.int32]:
    """Return (N, 3) the cells, relative to its reference cell, in which a part may be at any heading about its hook."""
    own, line = component.shape.cells, np.array(component.hook_line_vox[:2])
    radius = _radius_vox(component)
    reach = int(np.ceil(radius)) + 1
    x, y = (n.ravel() for n in np.meshgrid(*(np.arange(-reach, reach + 1) + int(np.rint(at)) for at in line)))
    nearest = np.hypot(np.maximum(np.abs(x - line[0]) - 0.5, 0.0), np.maximum(np.abs(y - line[1]) - 0.5, 0.0))
    columns = np.column_stack([x, y])[nearest < radius - 1e-6]
    layers = np.arange(own[:, 2].min(), own[:, 2].max() + 1)
    cells = np.column_stack([np.repeat(columns, len(layers), axis=0), np.tile(layers, len(columns))])
    return np.ascontiguousarray(cells, np.int32)


def _radius_vox(component: Component) -> float:
    """Return how far a part reaches from its hook line, in cells."""
    away = np.abs(component.shape.cells[:, :2] - np.array(component.hook_line_vox[:2])) + 0.5
    return float(np.hypot(*away.T).max())


def turning_rows(
    lift: Lift | None,
    component: Component | None,
    motion: LiftMotion,
    time_s: NDArray[np.float64],
    slew_rad: NDArray[np.float64],
) -> NDArray[np.bool_]:
    """Return (N,) at which positions of a loaded motion the heading may be any: from the first slewing to the turn.

    Its end may have gone as far as a position between two samples may reach into a cell. The last position before the
    first slewing counts too if by the next one its end has gone further than positions are apart.

    Args:
        lift: The lift; None if its load is not on its way yet.
        component: Its load; None for the empty hook.
        motion: Its motion.
        time_s: (N,) times from the start of the lift, of the sample at or before each position.
        slew_rad: (N,) slewing angles.
    """
    if lift is None or component is None or not lift.ever_with_jib or not len(slew_rad):
        return np.zeros(len(slew_rad), np.bool_)
    gone_vox = np.abs(slew_rad - motion.loaded.slew_rad[0]) * _radius_vox(component)
    slews = gone_vox > BETWEEN_VOX
    slews[:-1] |= gone_vox[1:] > SPACING_VOX
    turning: NDArray[np.bool_] = np.logical_or.accumulate(slews)
    if motion.turned_ns is not None:
        return turning & (time_s * 1e9 < motion.turned_ns[1] - motion.start_ns - _ROUNDED_NS)
    # It arrives in its final heading: from then on nothing slews.
    still = np.abs(slew_rad - motion.loaded.slew_rad[-1]) <= _STILL_RAD
    return turning & ~np.logical_and.accumulate(still[::-1])[::-1]


def turning_placements(lift: Lift) -> slice:
    """Return which placements of a path the load may be at with any heading; none if tag lines keep its heading.

    They reach from the end of the first moves straight up to the start of the last moves.
    """
    if not lift.with_jib or lift.path_vox is None:
        return slice(0, 0)
    steps = np.diff(lift.path_vox.astype(np.int64), axis=0)
    rises = (steps == (0, 0, 1)).all(axis=1)
    first = len(rises) if rises.all() else int(np.argmin(rises))
    return slice(first, max(0, len(lift.path_vox) - 1 - lift.contact_moves) + 1)


def check_rule(check: Check, site: Site, lift: Lift, component: Component) -> None:
    """Check that a load turns with the jib only where the rules say so, and that its last moves lead straight down."""
    if not lift.ever_with_jib:
        return
    asked = site.rules.heading is HeadingRule.WITH_JIB and len(site.cranes) == 1
    check.look(asked, f"{component.id}: turns with the jib, but the rules of the site keep headings by tag line")
    if lift.with_jib and lift.path_vox is not None:
        last = lift.last_moves_vox
        straight = len(last) > 1 and bool((last[:, :2] == last[-1, :2]).all())
        check.look(straight, f"{component.id}: turns with the jib, but its last moves do not lead straight down")


def check_heading(
    check: Check, name: str, site: Site, crane: TowerCrane, lift: Lift, component: Component, motion: LiftMotion
) -> None:
    """Check that a load that turned with the jib is turned to its final heading, at rest, and how long that takes."""
    left_ns = motion.start_ns + int(motion.loaded.time_ns[0])
    turns = [phase for phase in motion.phases if phase.name is PhaseName.TURN and phase.end_ns > left_ns]
    if not lift.ever_with_jib:
        check.look(not turns, f"{name}: its load is turned on its way, but tag lines keep its heading")
        return
    time_ns, axes = motion.loaded.time_ns + motion.start_ns, motion.loaded.axes
    check.look(len(turns) <= 1, f"{name}: its load is turned to its final heading {len(turns)} times")
    begins_ns = turns[0].start_ns if turns else int(time_ns[-1])
    off_rad = float(np.interp(begins_ns, time_ns, axes[:, 0]) - axes[0, 0])
    off_rad = abs((off_rad + pi) % (2.0 * pi) - pi)
    if not turns:
        check.look(off_rad <= _SAME, f"{name}: its load arrives {np.degrees(off_rad):.1f} degrees off its heading")
        return
    ends_ns = turns[0].end_ns
    least_ns = off_rad / (pi / 2.0) * site.rules.turn_s * 1e9
    check.look(
        ends_ns - begins_ns >= least_ns - _ROUNDED_NS,
        f"{name}: its load is turned by {np.degrees(off_rad):.1f} degrees in {(ends_ns - begins_ns) / 1e9:.6g} s; "
        f"the rules ask for {least_ns / 1e9:.6g} s",
    )
    ends = np.array([[np.interp(at, time_ns, axis) for axis in axes.T] for at in (begins_ns, ends_ns)])
    inside = axes[(time_ns >= begins_ns) & (time_ns <= ends_ns)]
    still = bool((np.ptp(np.concatenate([ends, inside]), axis=0) <= _SAME).all())
    check.look(still, f"{name}: its hook moves while its load is turned to its final heading")
    if lift.with_jib and lift.path_vox is not None:
        rigged = crane_for(site, crane, component)
        at = reference_cells(rigged, site.frame, ends[:1], component.hook_line_vox)[0]
        wanted = lift.last_moves_vox[0]
        check.look(
            bool((np.abs(at - wanted) <= _SAME_VOX).all()),
            f"{name}: its load is not turned to its final heading where its last moves begin, {tuple(wanted.tolist())}",
        )
