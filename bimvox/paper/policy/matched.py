"""Pairs of obstructions, close to the start and close to the target, that are alike in all else known to matter.

The paper's (b) and (d) differ in more than the distance: how long a detour they force, and whether the loaded network
already copes with them. Here the start is in line with the target, both obstructions of a pair force a detour of the
same length, and the loaded network copes with neither.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bimvox.paper.env.component import YardPose
from bimvox.paper.env.layout import PaperLayout, yard_layouts
from bimvox.paper.env.spec import PaperSpec
from bimvox.paper.policy.application import apply_layout, enough_succeed, trial_episodes
from bimvox.paper.policy.baselines import teacher_moves
from bimvox.paper.policy.config import PaperDqnConfig
from bimvox.paper.policy.episodes import Episode
from bimvox.paper.policy.network import ValueNetwork
from bimvox.paper.policy.scenarios import LEAST_PLAN_MOVES, plan_cells, possible_over
from bimvox.site.component import IntVec

CELLS_FROM_AN_END = 3
"""An obstruction of a pair covers one of so many cells of the planned path next to its end."""


@dataclass(frozen=True, slots=True, eq=False)
class MatchedPair:
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
) -> tuple[MatchedPair, ...]:
    """Return at most ``count`` pairs for a basic policy, each from another start, in an order drawn by the seed."""
    target = spec.components[0].target_vox
    starts = [layout for layout in yard_layouts(spec) if _in_line(layout.starts[0], target)]
    pairs: list[MatchedPair] = []
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
) -> MatchedPair | None:
    applied = apply_layout(network, spec, config, layout, seed=seed)
    cells = applied.episode.path_cells
    plan = plan_cells(cells)
    if not applied.episode.succeeded or len(plan) - 1 < LEAST_PLAN_MOVES:
        return None
    inner = range(1, len(plan) - 1)
    ends = (inner[:CELLS_FROM_AN_END], inner[: -CELLS_FROM_AN_END - 1 : -1])
    near, far = (
        _unmastered(
            network,
            spec,
            config,
            [changed for n in end for changed in possible_over(spec, layout, cells, plan[n], plan[n - 1], 1)],
            seed,
        )
        for end in ends
    )
    shortest = int(teacher_moves(spec, [layout])[0])
    for detour in sorted(near.keys() & far.keys()):
        if detour > shortest:
            return MatchedPair(applied.episode, near[detour], far[detour], detour - shortest)
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
            episodes = trial_episodes(network, spec, config, changed, config.retrain_episodes, seed)
            if not enough_succeed(config, episodes):
                kept[moves] = changed
    return kept
