"""The proof of the heading of a load: where it may be any, and that a crew has the time to turn it to the final one.

Of a load that turns with the jib, the heading is not followed: from the first slewing until it is turned to its final
heading it must be free at every heading, as a cylinder about its hook line.
"""

from __future__ import annotations

from math import pi

import numpy as np
from numpy.typing import NDArray

from bimvox.crane.tower_crane import TowerCrane
from bimvox.kept import kept
from bimvox.proof.space import BETWEEN_VOX, SPACING_VOX, reference_cells
from bimvox.records.lift import Lift
from bimvox.records.motion import LiftMotion, PhaseName
from bimvox.records.proof import Check
from bimvox.site.component import Component
from bimvox.site.lifting import crane_for
from bimvox.site.site import HeadingRule, Site

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
