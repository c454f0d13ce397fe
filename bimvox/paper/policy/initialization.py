"""The two layers: a basic policy for every start, then each layout's policy, adapted when obstructions appear."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bimvox.paper.env.layout import PaperLayout, random_layouts, yard_layouts
from bimvox.paper.env.spec import PaperSpec
from bimvox.paper.policy.config import PaperDqnConfig
from bimvox.paper.policy.episodes import CurvePoint, Episode, best_of, replay, run_episodes, success_rate
from bimvox.paper.policy.learning import learn
from bimvox.paper.policy.network import ValueNetwork

_GREEDY_SEED = 1_000_003
"""Seed of the drawn layouts of greedy tests, independent of the training's seed."""


@dataclass(frozen=True, slots=True, eq=False)
class _BasicPolicy:
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
    checkpoint: Callable[[ValueNetwork, int], None] | None = None,
) -> _BasicPolicy:
    """Train from random starts without obstructions until tests reach the required success rate.

    A test has ``config.test_episodes`` episodes from random starts with ``config.test_exploration`` random actions.
    With ``config.greedy_too``, the same rate is required without random actions from every start
    (:func:`greedy_layouts`). ``checkpoint`` receives the network and the steps before every test. The same arguments
    give the same weights.
    """
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
        episodes = trial_episodes(network, spec, config, starts, int(draw[1]))
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
        return reached

    steps = learn(spec, config, test, seed=seed, budget=config.budget)
    return _BasicPolicy(best[0], reached, tuple(curve), steps)


def greedy_layouts(spec: PaperSpec, config: PaperDqnConfig) -> tuple[PaperLayout, ...]:
    """Return the layouts of greedy tests: every distinct start if nothing else is drawn, otherwise drawn layouts."""
    if spec.count == 1 and not spec.random_targets and spec.random_obstructions is None:
        return yard_layouts(spec)
    return random_layouts(spec, config.greedy_layouts, _GREEDY_SEED)


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


@dataclass(frozen=True, slots=True, eq=False)
class AppliedPolicy:
    """A layout's policy: the plan, which is the trial episode with the highest reward, and the trial's success rate."""

    episode: Episode
    success_rate: float


@dataclass(frozen=True, slots=True, eq=False)
class _AdaptedPolicy:
    """A layout's policy in the changed site.

    Attributes:
        network: The site's policy from now on.
        episode: The new plan. None if nothing was learned within the budget.
        retrained: Whether the network was retrained.
        succeeded: Whether there is a plan: kept, found by the loaded network, or learned.
        steps: Environment steps of retraining.
        curve: Every test; one at 0 steps is of the loaded network.
        collision: Index of the first move of the planned path that an obstruction blocks. None if none is.
        success_rate: In the last test; 1 for a kept path.
    """

    network: ValueNetwork
    episode: Episode | None
    retrained: bool
    succeeded: bool
    steps: int
    curve: tuple[CurvePoint, ...]
    collision: int | None
    success_rate: float


def apply_layout(
    network: ValueNetwork, spec: PaperSpec, config: PaperDqnConfig, layout: PaperLayout, *, seed: int
) -> AppliedPolicy:
    """Run the trial episodes on a layout without its obstructions, and keep the one with the highest reward.

    There are ``config.trials`` episodes with the share ``config.test_exploration`` of random actions.
    """
    bare = replace(layout, obstructions=())
    episodes = trial_episodes(network, spec, config, [bare] * config.trials, seed)
    return AppliedPolicy(best_of(episodes), success_rate(episodes))


def adapt(
    network: ValueNetwork,
    planned: Episode,
    spec: PaperSpec,
    config: PaperDqnConfig,
    changed: PaperLayout,
    *,
    seed: int,
) -> _AdaptedPolicy:
    """Keep the planned episode if nothing blocks its path; otherwise retrain the network on the changed layout.

    Training stops when ``config.retrain_successes`` of ``config.retrain_episodes`` test episodes succeed, or after
    ``config.retrain_budget`` steps. The episode with the highest reward is the new plan, and the network is the site's
    new policy. The same arguments give the same weights.
    """
    budget = config.retrain_budget
    collision = collision_of(spec, changed, planned)
    if collision is None and planned.succeeded:
        return _AdaptedPolicy(network, planned, False, True, 0, (), None, 1.0)

    curve: list[CurvePoint] = []
    last: list[tuple[ValueNetwork, tuple[Episode, ...]]] = []

    def test(tested: ValueNetwork, steps: int) -> bool:
        draw = int(np.random.SeedSequence([seed, steps]).generate_state(1)[0])
        episodes = trial_episodes(tested, spec, config, [changed] * config.retrain_episodes, draw)
        curve.append(CurvePoint(steps, success_rate(episodes), float(np.mean([e.reward for e in episodes]))))
        last[:] = [(tested, episodes)]
        return enough_succeed(config, episodes)

    good = test(network, 0)
    steps = 0
    if not (good and config.test_loaded_first):
        steps = learn(spec, config, test, seed=seed, budget=budget, layouts=[changed], initial=network)
    tested, episodes = last[0]
    succeeded = enough_succeed(config, episodes)
    successful = [episode for episode in episodes if episode.succeeded]
    return _AdaptedPolicy(
        tested,
        best_of(successful) if succeeded else None,
        steps > 0,
        succeeded,
        steps,
        tuple(curve),
        collision,
        curve[-1].success_rate,
    )


def enough_succeed(config: PaperDqnConfig, episodes: tuple[Episode, ...]) -> bool:
    """Return whether enough test episodes succeeded for retraining to stop."""
    return sum(episode.succeeded for episode in episodes) >= config.retrain_successes


def collision_of(spec: PaperSpec, changed: PaperLayout, planned: Episode) -> int | None:
    """Return the move at which a planned path is blocked in a changed site. None if it is not.

    Blocked moves of the plan itself do not belong to its path.
    """
    again = replay(spec, changed, planned.moves)
    return int(np.flatnonzero(again.bumped)[0]) if again.bumped.any() else None


def trial_episodes(
    network: ValueNetwork, spec: PaperSpec, config: PaperDqnConfig, layouts: Sequence[PaperLayout], seed: int
) -> tuple[Episode, ...]:
    """Return an episode of a network on each layout, with the share of random actions of tests."""
    return run_episodes(
        network,
        spec,
        layouts,
        observation=config.flat_observation,
        reward=config.reward,
        exploration=config.test_exploration,
        seed=seed,
    )
