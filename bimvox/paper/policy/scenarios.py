"""The paper's four experiments: obstructions placed by rule on the planned path.

(a) none; (b) one close to the start; (c) as (b), with a second one next to it in the same line; (d) one close to the
target. Each obstruction is three cells long and two high, and covers the possible cell of the path nearest to the start
(the target). Of the possible positions there, the one with the longest detour is chosen, so that there is something to
learn; among equals, the one across the path and centred on it. A position is possible if it touches neither the cells
of the start (stored and hoisted) nor of the target, is inside the site, and leaves a path short enough for an episode,
by the exact distance field.

Pairs of obstructions, close to the start and close to the target, that are alike in all else known to matter.

The paper's (b) and (d) differ in more than the distance: how long a detour they force, and whether the loaded network
already copes with them. Here the start is in line with the target, both obstructions of a pair force a detour of the
same length, and the loaded network copes with neither.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bimvox.errors import PlanningError
from bimvox.paper.env.layout import PaperLayout, check_layout, yard_layouts
from bimvox.paper.env.spec import Box, PaperSpec, YardPose, above_slab, obstruction, overlap
from bimvox.paper.policy.baselines import teacher_moves
from bimvox.paper.policy.config import PaperDqnConfig
from bimvox.paper.policy.episodes import Episode
from bimvox.paper.policy.initialization import apply_layout, enough_succeed, trial_episodes
from bimvox.paper.policy.network import ValueNetwork
from bimvox.site.component import IntVec

_LENGTH_VOX = 3
_HEIGHT_VOX = 2
_LEAST_PLAN_MOVES = 6
"""Least moves in plan of a path, so that its start and its end are apart."""


def make_scenarios(spec: PaperSpec, layout: PaperLayout, path_cells: Sequence[IntVec]) -> dict[str, PaperLayout]:
    """Return the layouts of the four experiments on a planned path, by name.

    ``path_cells`` are the reference cells of the path on ``layout``, from the start to the target. The site must have
    one component, and the layout no obstructions.

    Raises:
        PlanningError: The path is too short, or there is no room for an obstruction on it.
    """
    plan = _plan_cells(path_cells)
    if len(plan) - 1 < _LEAST_PLAN_MOVES:
        raise PlanningError(f"a path of {len(plan) - 1} moves in plan is too short for the experiments")
    forward = list(zip(plan[1:-1], plan, strict=False))
    backward = [(cell, towards) for cell, towards in itertools.pairwise(plan)][:0:-1]
    return {
        "a": layout,
        "b": _first(spec, layout, path_cells, forward, 1),
        "c": _first(spec, layout, path_cells, forward, 2),
        "d": _first(spec, layout, path_cells, backward, 1),
    }


def _plan_cells(path_cells: Sequence[IntVec]) -> list[IntVec]:
    """Return the cells of a path without those that differ from the one before only in height."""
    return [cell for n, cell in enumerate(path_cells) if n == 0 or cell[:2] != path_cells[n - 1][:2]]


def _first(
    spec: PaperSpec,
    layout: PaperLayout,
    path_cells: Sequence[IntVec],
    places: Sequence[tuple[IntVec, IntVec]],
    count: int,
) -> PaperLayout:
    """Return the layout with a row of obstructions over the first cell where one is possible."""
    for cell, neighbour in places:
        possible = _possible_over(spec, layout, path_cells, cell, neighbour, count)
        if possible:
            moves = teacher_moves(spec, possible)
            if moves.max() > 0:
                return possible[int(moves.argmax())]
    raise PlanningError(f"there is no room for {count} obstructions on a path from {path_cells[0]} to {path_cells[-1]}")


def _possible_over(
    spec: PaperSpec,
    layout: PaperLayout,
    path_cells: Sequence[IntVec],
    cell: IntVec,
    neighbour: IntVec,
    count: int,
) -> list[PaperLayout]:
    """Return the layouts with a possible row of obstructions over a cell of a path, those across the path first."""
    across = ("y", "x") if cell[0] != neighbour[0] else ("x", "y")
    candidates = [replace(layout, obstructions=row) for axis in across for row in _rows(cell, axis, count)]
    return [changed for changed in candidates if _may_be(spec, changed, path_cells)]


def _rows(cell: IntVec, axis: str, count: int) -> Iterator[tuple[Box, ...]]:
    """Yield rows of obstructions, end to end along an axis, over a cell: the most central first."""
    whole = _LENGTH_VOX * count
    for before in sorted(range(whole), key=lambda n: (abs(2 * n + 1 - whole), n)):
        yield tuple(
            obstruction(
                cell[0] + (start if axis == "x" else 0),
                cell[1] + (start if axis == "y" else 0),
                axis,
                _LENGTH_VOX,
                _HEIGHT_VOX,
            )
            for start in range(-before, whole - before, _LENGTH_VOX)
        )


def _may_be(spec: PaperSpec, changed: PaperLayout, path_cells: Sequence[IntVec]) -> bool:
    """Return whether obstructions are inside the site, on the path, and touch neither of its ends."""
    part = spec.components[0]
    if not all(above_slab(box, spec.shape) for box in changed.obstructions):
        return False
    try:
        check_layout(spec, changed)
    except ValueError:
        return False
    return any(overlap(part.box_at(cell), box) for cell in path_cells for box in changed.obstructions)


_CELLS_FROM_AN_END = 3
"""An obstruction of a pair covers one of so many cells of the planned path next to its end."""


@dataclass(frozen=True, slots=True, eq=False)
class _MatchedPair:
    """One start with two changed sites.

    Attributes:
        planned: The episode that both obstructions block.
        near: The site with an obstruction close to the start.
        far: The same with one close to the target.
        detour_moves: Moves by which the shortest path is longer than without either.
    """

    planned: Episode
    near: PaperLayout
    far: PaperLayout
    detour_moves: int


def matched_pairs(
    network: ValueNetwork, spec: PaperSpec, config: PaperDqnConfig, *, seed: int, count: int
) -> tuple[_MatchedPair, ...]:
    """Return at most ``count`` pairs for a basic policy, each from another start, in an order drawn by the seed."""
    target = spec.components[0].target_vox
    starts = [layout for layout in yard_layouts(spec) if _in_line(layout.starts[0], target)]
    pairs: list[_MatchedPair] = []
    for n in np.random.default_rng(seed).permutation(len(starts)):
        pair = _pair(network, spec, config, starts[n], seed)
        if pair is not None:
            pairs.append(pair)
        if len(pairs) == count:
            break
    return tuple(pairs)


def _in_line(start: YardPose, target: IntVec) -> bool:
    return start.x == target[0] or start.y == target[1]


def _pair(
    network: ValueNetwork, spec: PaperSpec, config: PaperDqnConfig, layout: PaperLayout, seed: int
) -> _MatchedPair | None:
    applied = apply_layout(network, spec, config, layout, seed=seed)
    cells = applied.episode.path_cells
    plan = _plan_cells(cells)
    if not applied.episode.succeeded or len(plan) - 1 < _LEAST_PLAN_MOVES:
        return None
    inner = range(1, len(plan) - 1)
    ends = (inner[:_CELLS_FROM_AN_END], inner[: -_CELLS_FROM_AN_END - 1 : -1])
    near, far = (
        _unmastered(
            network,
            spec,
            config,
            [changed for n in end for changed in _possible_over(spec, layout, cells, plan[n], plan[n - 1], 1)],
            seed,
        )
        for end in ends
    )
    shortest = int(teacher_moves(spec, [layout])[0])
    for detour in sorted(near.keys() & far.keys()):
        if detour > shortest:
            return _MatchedPair(applied.episode, near[detour], far[detour], detour - shortest)
    return None


def _unmastered(
    network: ValueNetwork, spec: PaperSpec, config: PaperDqnConfig, sites: Sequence[PaperLayout], seed: int
) -> dict[int, PaperLayout]:
    """Return the first site of each length of the shortest path on which the loaded network is not good enough."""
    if not sites:
        return {}
    kept: dict[int, PaperLayout] = {}
    for moves, changed in zip(teacher_moves(spec, sites).tolist(), sites, strict=True):
        if moves > 0 and moves not in kept:
            episodes = trial_episodes(network, spec, config, [changed] * config.retrain_episodes, seed)
            if not enough_succeed(config, episodes):
                kept[moves] = changed
    return kept
