"""The Markov decision process: how an episode begins, what a move and assembling do, when it ends.

Small functions that the single and the batched environment share. :func:`_transition`, :func:`move`,
:func:`_has_arrived`, :func:`is_late`, :func:`is_complete` and :func:`is_truncated` are pure; :func:`stand_up` and
:func:`assemble` write the arrays of a site.

The reward of an action is the formula of ``bimvox.env.dynamics``, with serial numbers as in the paper. Equation (1) of
Zhu, Pauwels and de Vries (2021), r0 = -1: each step of component i costs r0 / S_i, twice that from its step limit on;
the step that assembles it earns n S_i and costs nothing: "only when the agent completes the task, it can get a positive
reward" (the authors' script does the same). S_i is the serial number of the component, n their number.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import kernel, leaf_kernel
from bimvox.env.actions import MOVES
from bimvox.env.dynamics import NO_ACTION, REWARDS, RewardWeights, reward
from bimvox.env.problem import distance_field
from bimvox.grid.summed_area import summed_area_table
from bimvox.paper.env.spec import HUNG_LAYER, STORED_LAYER
from bimvox.paper.env.state import AIR, FIRST_COMPONENT, GROUND, OBSTRUCTION, PaperState, SiteState, SpecArrays
from bimvox.site.collision import CollisionSpace, placement_is_free


class PaperReward(NamedTuple):
    """A way to reward actions, as a tuple for kernels.

    Attributes:
        weights: Coefficients of :func:`bimvox.env.dynamics.reward`.
        by_serial: Whether the step cost is divided by S_i, and an arrival earns n S_i alone.
    """

    weights: RewardWeights
    by_serial: bool


PAPER_REWARDS: dict[str, PaperReward] = {
    "paper": PaperReward(RewardWeights(progress=0.0, step=-1.0, late_step=-1.0, bump=0.0, arrival=1.0), by_serial=True),
    "shaped": PaperReward(REWARDS["shaped"], by_serial=False),
    "sparse": PaperReward(REWARDS["sparse"], by_serial=False),
}
"""``paper``: equation (1). ``shaped``: the exact distance-to-go of the component in transit is the teacher.
``sparse``: every step costs the same, twice as much when late; every arrival earns the same."""


@leaf_kernel
def _earned(
    scheme: PaperReward,
    serial: int,
    count: int,
    distance: int,
    next_distance: int,
    bumped: bool,
    arrived: bool,
    late: bool,
) -> float:
    """Return the reward of one action.

    ``scheme``: how actions are rewarded; ``serial``: s_i of the component in transit, from 1; ``distance``: moves to
    its target before the action; ``next_distance``: moves to its target after the action; ``bumped``: whether the move
    was blocked; ``arrived``: whether the component was assembled; ``late``: whether its step limit had been reached
    before.
    """
    weights = scheme.weights
    if scheme.by_serial:
        if arrived:
            return float(weights.arrival * count * serial)
        weights = RewardWeights(
            weights.progress, weights.step / serial, weights.late_step / serial, weights.bump, weights.arrival
        )
    return reward(weights, distance, next_distance, bumped, arrived, late)


@leaf_kernel
def may_be(rules: SpecArrays, site: SiteState, component: int, x: int, y: int, z: int) -> bool:
    """Return whether a component in transit may have its reference cell at (x, y, z): the one rule of collision."""
    return placement_is_free(
        CollisionSpace(
            site.table,
            rules.boxes[component : component + 1],
            rules.zeros,
            rules.hook_floor,
            rules.zeros,
            rules.cleared,
            rules.no_ceiling,
        ),
        x,
        y,
        z,
    )


@kernel
def clearance_of(rules: SpecArrays, site: SiteState, component: int) -> CollisionSpace:
    """Return the collision rule of a component in transit, as views."""
    return CollisionSpace(
        site.table,
        rules.boxes[component : component + 1],
        rules.zeros,
        rules.hook_floor,
        rules.zeros,
        rules.cleared,
        rules.no_ceiling,
    )


@leaf_kernel
def _transition(rules: SpecArrays, site: SiteState, state: PaperState, action: int) -> tuple[PaperState, bool]:
    """Move the component in transit by one cell; return the next state and whether the move was blocked.

    A blocked move takes a step and moves nothing. Nothing moves once everything is assembled.
    """
    steps, total = int(state.steps + 1), int(state.total + 1)
    i = int(state.component)
    x, y, z = int(state.x), int(state.y), int(state.z)
    u, v, w = int(x + MOVES[action, 0]), int(y + MOVES[action, 1]), int(z + MOVES[action, 2])
    if i < rules.boxes.shape[0] and may_be(rules, site, i, u, v, w):
        return PaperState(i, u, v, w, int(action), steps, total), False
    return PaperState(i, x, y, z, int(action), steps, total), True


@leaf_kernel
def _has_arrived(site: SiteState, state: PaperState) -> bool:
    """Return whether the component in transit is at its target, where it is assembled at once."""
    i = state.component
    if i >= site.target.shape[0]:
        return False
    return bool(state.x == site.target[i, 0] and state.y == site.target[i, 1] and state.z == site.target[i, 2])


@leaf_kernel
def is_late(rules: SpecArrays, state: PaperState) -> bool:
    """Return whether the component in transit has used up its restricted number of steps: s >= limit."""
    return bool(state.component < rules.boxes.shape[0] and state.steps >= rules.step_limit)


@leaf_kernel
def is_complete(rules: SpecArrays, state: PaperState) -> bool:
    """Return whether every component is assembled: success, the only terminal state."""
    return bool(state.component >= rules.boxes.shape[0])


@leaf_kernel
def is_truncated(rules: SpecArrays, state: PaperState) -> bool:
    """Return whether the steps of the episode were used up first: failure."""
    return bool(state.total >= rules.max_steps and not is_complete(rules, state))


@leaf_kernel
def paint(cells: NDArray[np.int16], x0: int, y0: int, z0: int, x1: int, y1: int, z1: int, what: int) -> None:
    """Write a number into a half-open box of cells."""
    for x in range(x0, x1):
        for y in range(y0, y1):
            for z in range(z0, z1):
                cells[x, y, z] = what


@leaf_kernel
def length_of(rules: SpecArrays, component: int) -> int:
    """Return the length of a component, cells."""
    box = rules.boxes[component]
    return int(max(box[3], box[4], box[5]))


@leaf_kernel
def lying(length: int, axis: int) -> tuple[int, int]:
    """Return the edges along x and y of a component that lies along an axis."""
    if axis == 0:
        return length, 1
    return 1, length


@leaf_kernel
def paint_stored(rules: SpecArrays, site: SiteState, component: int, what: int) -> None:
    """Write a number into the cells where a component lies in the yard."""
    x, y = site.stored[component, 0], site.stored[component, 1]
    dx, dy = lying(length_of(rules, component), site.stored[component, 2])
    paint(site.cells, x, y, STORED_LAYER, x + dx, y + dy, STORED_LAYER + 1, what)


@leaf_kernel
def paint_built(rules: SpecArrays, site: SiteState, component: int, what: int) -> None:
    """Write a number into the cells of a component at its target."""
    x, y, z = site.target[component]
    dx, dy, dz = rules.boxes[component, 3:]
    paint(site.cells, x, y, z, x + dx, y + dy, z + dz, what)


@leaf_kernel
def paint_fixed(site: SiteState) -> None:
    """Clear the cells, and write the slab and the obstructions."""
    nx, ny, nz = site.cells.shape
    paint(site.cells, 0, 0, 0, nx, ny, nz, AIR)
    paint(site.cells, 0, 0, 0, nx, ny, 1, GROUND)
    for m in range(site.obstructions.shape[0]):
        x0, y0, z0, x1, y1, z1 = site.obstructions[m]
        paint(site.cells, x0, y0, z0, x1, y1, z1, OBSTRUCTION)


@kernel
def _take_up(rules: SpecArrays, site: SiteState, component: int, total: int) -> PaperState:
    """Pick a component from the yard: a column is upended; it then hangs in transit, one cell higher."""
    paint_stored(rules, site, component, AIR)
    site.table[:] = summed_area_table(site.cells != AIR)
    if site.field.size > 0:
        site.field[:] = distance_field(clearance_of(rules, site, component), site.target[component])
    x, y = site.stored[component, 0], site.stored[component, 1]
    return PaperState(int(component), int(x), int(y), HUNG_LAYER, NO_ACTION, 0, int(total))


@kernel
def stand_up(rules: SpecArrays, site: SiteState) -> PaperState:
    """Begin an episode of the layout that a site holds: everything stored, the first component picked."""
    paint_fixed(site)
    for i in range(rules.boxes.shape[0]):
        paint_stored(rules, site, i, FIRST_COMPONENT + i)
    count = rules.boxes.shape[0]
    return _take_up(rules, site, count - count, 0)


@kernel
def assemble(rules: SpecArrays, site: SiteState, state: PaperState) -> PaperState:
    """Set the component that has arrived, and pick the next."""
    i = int(state.component)
    paint_built(rules, site, i, FIRST_COMPONENT + i)
    if i + 1 < rules.boxes.shape[0]:
        return _take_up(rules, site, i + 1, state.total)
    site.table[:] = summed_area_table(site.cells != AIR)
    return PaperState(i + 1, int(state.x), int(state.y), int(state.z), NO_ACTION, 0, int(state.total))


@leaf_kernel
def move(
    rules: SpecArrays, scheme: PaperReward, site: SiteState, state: PaperState, action: int
) -> tuple[PaperState, float, bool, bool]:
    """Take one action without assembling; return the next state, the reward, and whether it was blocked or arrived."""
    moved, bumped = _transition(rules, site, state, action)
    arrived = _has_arrived(site, moved)
    value = _earned(
        scheme,
        state.component + 1,
        rules.boxes.shape[0],
        _distance_to_go(site, state),
        _distance_to_go(site, moved),
        bumped,
        arrived,
        is_late(rules, state),
    )
    return moved, value, bumped, arrived


@leaf_kernel
def _distance_to_go(site: SiteState, state: PaperState) -> int:
    """Return the moves to the target; -1 if there is no path, 0 on a site without the field."""
    if site.field.size == 0:
        return 0
    return int(site.field[state.x, state.y, state.z])
