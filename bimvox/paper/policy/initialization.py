"""The initialization layer: a basic policy for every start, trained from random places in the yard."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from bimvox.paper.env.layout import PaperLayout, random_layouts, yard_layouts
from bimvox.paper.env.spec import PaperSpec
from bimvox.paper.policy.config import PaperDqnConfig
from bimvox.paper.policy.curve import CurvePoint
from bimvox.paper.policy.episodes import run_episodes, success_rate
from bimvox.paper.policy.learning import learn
from bimvox.paper.policy.network import ValueNetwork

GREEDY_SEED = 1_000_003
"""Seed of the drawn layouts of greedy tests, independent of the training's seed."""


@dataclass(frozen=True, slots=True, eq=False)
class BasicPolicy:
    """The result of the initialization layer.

    Attributes:
        network: The first one that was good enough; otherwise the best tested one.
        reached: Whether it was good enough within the budget.
        curve: Every test.
        steps: Environment steps taken.
    """

    network: ValueNetwork
    reached: bool
    curve: tuple[CurvePoint, ...]
    steps: int


def initialize(
    spec: PaperSpec,
    config: PaperDqnConfig,
    *,
    seed: int,
    budget: int | None = None,
    progress: Callable[[CurvePoint], None] | None = None,
    checkpoint: Callable[[ValueNetwork, int], None] | None = None,
) -> BasicPolicy:
    """Train from random starts without obstructions until tests reach the required success rate.

    A test has ``config.test_episodes`` episodes from random starts with ``config.test_exploration`` random actions.
    With ``config.greedy_too``, the same rate is required without random actions from every start
    (:func:`greedy_layouts`). ``budget`` replaces the configuration's. ``checkpoint`` receives the network and the steps
    before every test, ``progress`` the test. The same arguments give the same weights.
    """
    budget = config.budget if budget is None else budget
    everywhere = greedy_layouts(spec, config)
    curve: list[CurvePoint] = []
    best: list[ValueNetwork] = []
    best_rank = (-1.0, -1.0)
    reached = False

    def test(network: ValueNetwork, steps: int) -> bool:
        nonlocal best_rank, reached
        if checkpoint is not None:
            checkpoint(network, steps)
        draw = np.random.SeedSequence([seed, steps]).generate_state(2)
        starts = random_layouts(spec, config.test_episodes, int(draw[0]))
        episodes = run_episodes(
            network,
            spec,
            starts,
            observation=config.flat_observation,
            reward=config.reward,
            exploration=config.test_exploration,
            seed=int(draw[1]),
        )
        rate = success_rate(episodes)
        greedy = greedy_success(network, spec, config, everywhere)
        point = CurvePoint(steps, rate, float(np.mean([e.reward for e in episodes])), greedy)
        curve.append(point)
        rank = (min(rate, greedy) if config.greedy_too else rate, greedy)
        if rank > best_rank:
            best_rank = rank
            best[:] = [network]
        reached = rate >= config.required_success and (not config.greedy_too or greedy >= config.required_success)
        if reached:
            best[:] = [network]
        if progress is not None:
            progress(point)
        return reached

    steps = learn(spec, config, test, seed=seed, budget=budget)
    return BasicPolicy(best[0], reached, tuple(curve), steps)


def greedy_layouts(spec: PaperSpec, config: PaperDqnConfig) -> tuple[PaperLayout, ...]:
    """Return the layouts of greedy tests: every distinct start if nothing else is drawn, otherwise drawn layouts."""
    if spec.count == 1 and not spec.random_targets and spec.random_obstructions is None:
        return yard_layouts(spec)
    return random_layouts(spec, config.greedy_layouts, GREEDY_SEED)


def greedy_success(
    network: ValueNetwork, spec: PaperSpec, config: PaperDqnConfig, layouts: Sequence[PaperLayout]
) -> float:
    """Return the share of layouts on which a policy succeeds without random actions or guard."""
    episodes = run_episodes(
        network,
        spec,
        layouts,
        observation=config.flat_observation,
        reward="paper",  # only success counts here, and the exact distance takes time
        exploration=0.0,
        seed=0,
    )
    return success_rate(episodes)
