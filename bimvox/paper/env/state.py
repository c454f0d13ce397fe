"""A site under construction for kernels: its description, numbers that change every step, and arrays that seldom do."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import leaf_kernel
from bimvox.env.dynamics import LiftState
from bimvox.paper.env.spec import AXES, ComponentKind, PaperSpec

AIR, GROUND, OBSTRUCTION, FIRST_COMPONENT = 0, 1, 2, 3
"""Values of ``SiteState.cells``; component i (from 0) is ``FIRST_COMPONENT + i``."""

STATE_SIZE = 7


class PaperState(NamedTuple):
    """Which component is in transit, where, and since when, as a tuple for kernels.

    Attributes:
        component: Index of the component in transit, from 0; equal to the number of assembled ones, so n at the end.
        x: Its reference cell; at the end, that of the last one.
        y: Reference cell.
        z: Reference cell.
        last_action: The action taken last with this component, ``NO_ACTION`` before the first.
        steps: Actions taken with this component, blocked ones included.
        total: Actions taken in the episode.
    """

    component: int
    x: int
    y: int
    z: int
    last_action: int
    steps: int
    total: int


class SiteState(NamedTuple):
    """The arrays of one site. They change only when an episode starts and when a component is assembled.

    Attributes:
        cells: (X, Y, Z) int16 what fills each cell, without the component in transit.
        table: (X + 1, Y + 1, Z + 1) int32 summed-area table of the filled cells.
        stored: (n, 3) int64 x, y and axis (0 or 1) of each component's place in the yard.
        target: (n, 3) int32 reference cells.
        obstructions: (M, 6) int32 half-open boxes ``x0 y0 z0 x1 y1 z1``; unused rows are zeros.
        field: (X, Y, Z) int16 moves to the target of the component in transit, -1 if there is no path; size 0 if
            it is not needed.
    """

    cells: NDArray[np.int16]
    table: NDArray[np.int32]
    stored: NDArray[np.int64]
    target: NDArray[np.int32]
    obstructions: NDArray[np.int32]
    field: NDArray[np.int16]


@leaf_kernel
def lift_state(state: PaperState) -> LiftState:
    """Return a state as the observation of one lift reads it."""
    return LiftState(state.x, state.y, state.z, state.last_action, state.steps)


class SpecArrays(NamedTuple):
    """The constants of a site with n components, as a tuple for kernels.

    Attributes:
        boxes: (n, 6) int32 half-open box of each component in transit, relative to its reference cell: 0 0 0, edges.
        step_limit: Steps after which a component is late.
        max_steps: Steps of an episode.
        zeros: (3,) int32 zeros: offsets of a collision rule without rope rule or narrow phase.
        hook_floor: (X, Y) int32 zeros: no rope rule.
        cleared: (0, 0, 0) bool: no narrow phase.
        no_ceiling: (0, 0) int32: no limit to the hook's height.
    """

    boxes: NDArray[np.int32]
    step_limit: int
    max_steps: int
    zeros: NDArray[np.int32]
    hook_floor: NDArray[np.int32]
    cleared: NDArray[np.bool_]
    no_ceiling: NDArray[np.int32]


class Drawing(NamedTuple):
    """How layouts with at most M obstructions are drawn, as a tuple for kernels.

    Attributes:
        axis: (n,) int32 the only axis along which it may lie in the yard, 0 or 1; -1 for either.
        start: (n, 3) int64 x, y, axis of the place in the yard; -1 if it is drawn.
        target: (n, 3) int32 as designed.
        group: (n,) int32 components of one group keep their relative positions when targets are drawn.
        yard: (X, Y) bool.
        area: (4,) int32 ``x0 y0 x1 y1`` of the construction area.
        obstructions: (M, 6) int32, the fixed ones, then rows of zeros.
        fixed: Number of fixed obstructions.
        fewest: Least number of drawn ones.
        most: Greatest number of drawn ones.
        drawn_length: Of the drawn ones, cells.
        drawn_height: Of the drawn ones, cells.
        random_targets: Whether targets are drawn.
    """

    axis: NDArray[np.int32]
    start: NDArray[np.int64]
    target: NDArray[np.int32]
    group: NDArray[np.int32]
    yard: NDArray[np.bool_]
    area: NDArray[np.int32]
    obstructions: NDArray[np.int32]
    fixed: int
    fewest: int
    most: int
    drawn_length: int
    drawn_height: int
    random_targets: bool


def rules_of(spec: PaperSpec) -> SpecArrays:
    """Return a site's rules.

    Raises:
        ValueError: The components are not in the order of building.
    """
    if spec.building_order() != tuple(range(1, spec.count + 1)):
        raise ValueError("components: not in the order of building; take spec.in_building_order()")
    size = np.array([part.size_vox for part in spec.components], np.int32)
    return SpecArrays(
        boxes=np.concatenate([np.zeros_like(size), size], axis=1),
        step_limit=spec.steps_before_late,
        max_steps=spec.steps_allowed,
        zeros=np.zeros(3, np.int32),
        hook_floor=np.zeros(spec.shape[:2], np.int32),
        cleared=np.zeros((0, 0, 0), np.bool_),
        no_ceiling=np.zeros((0, 0), np.int32),
    )


def drawing_of(spec: PaperSpec, *, room_for: int = 0) -> Drawing:
    """Return how layouts are drawn on a site whose components are in the order of building.

    A layout has room for at least ``room_for`` obstructions.
    """
    parts = spec.components
    fixed = np.array([(*low, *high) for low, high in spec.obstructions], np.int32).reshape(-1, 6)
    drawn = spec.random_obstructions
    room = max(len(fixed) + (drawn.most if drawn else 0), room_for)
    nx, ny, _ = spec.shape
    return Drawing(
        axis=np.array([-1 if p.kind is ComponentKind.COLUMN else AXES.index(p.axis) for p in parts], np.int32),
        start=np.array(
            [(p.start.x, p.start.y, AXES.index(p.start.axis)) if p.start else (-1, -1, -1) for p in parts], np.int64
        ),
        target=np.array([part.target_vox for part in parts], np.int32),
        group=_groups(spec),
        yard=np.array([[spec.in_yard(x, y) for y in range(ny)] for x in range(nx)], np.bool_),
        area=np.array(spec.construction_area, np.int32),
        obstructions=np.concatenate([fixed, np.zeros((room - len(fixed), 6), np.int32)]),
        fixed=len(fixed),
        fewest=drawn.fewest if drawn else 0,
        most=drawn.most if drawn else 0,
        drawn_length=drawn.length_vox if drawn else 0,
        drawn_height=drawn.height_vox if drawn else 0,
        random_targets=bool(spec.random_targets),
    )


def empty_site(spec: PaperSpec, drawing: Drawing, *, with_field: bool) -> SiteState:
    """Return arrays of the right shapes for one site."""
    return SiteState(*(array[0] for array in empty_sites(spec, drawing, 1, with_field=with_field)))


def empty_sites(spec: PaperSpec, drawing: Drawing, sites: int, *, with_field: bool) -> SiteState:
    """Return arrays for many sites; each has a first axis of that length."""
    nx, ny, nz = spec.shape
    field_shape = spec.shape if with_field else (0, 0, 0)
    return SiteState(
        np.zeros((sites, nx, ny, nz), np.int16),
        np.zeros((sites, nx + 1, ny + 1, nz + 1), np.int32),
        np.zeros((sites, spec.count, 3), np.int64),
        np.zeros((sites, spec.count, 3), np.int32),
        np.zeros((sites, *drawing.obstructions.shape), np.int32),
        np.zeros((sites, *field_shape), np.int16),
    )


def _groups(spec: PaperSpec) -> NDArray[np.int32]:
    """Return the group of each component: components that wait for one another, directly or not, share one."""
    group = list(range(spec.count))
    for serial in range(1, spec.count + 1):
        for other in spec.waits_for(serial):
            old, new = group[serial - 1], group[other - 1]
            group = [new if g == old else g for g in group]
    return np.unique(group, return_inverse=True)[1].astype(np.int32)
