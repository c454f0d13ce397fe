"""The two layers: a basic policy for every start, then each layout's policy, adapted when obstructions appear."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch

from bimvox.env.actions import ACTION_COUNT, MOVES
from bimvox.env.observation import WAY_SIZE
from bimvox.paper.env.batched import BatchedPaperSite
from bimvox.paper.env.layout import PaperLayout, random_layouts, yard_layouts
from bimvox.paper.env.observation import OBSERVATION_SIZE, SCALES, WINDOW, WINDOW_SIZE
from bimvox.paper.env.spec import PaperSpec
from bimvox.paper.policy.config import PaperDqnConfig
from bimvox.paper.policy.curve import CurvePoint
from bimvox.paper.policy.episodes import Episode, best_of, replay, run_episodes, success_rate
from bimvox.paper.policy.network import PaperPolicy, ValueNetwork
from bimvox.policy.dqn import BatchDqn, Trained
from bimvox.policy.replay import Transitions
from bimvox.policy.vec_env import BatchVecEnv, TestsAtIntervals

# One training run with tests at intervals; both layers consist of such runs. A transition has eight images: the
# rotations and mirrorings of its site in plan. The rules are the same in every direction in plan and in a mirror. A
# rotated or mirrored transition is therefore a possible transition on the rotated or mirrored site, with the same
# reward. With gradient steps on such images (data augmentation), one environment step teaches as much as eight. The
# images are exact: the windows are square in plan and centred on the component on every level, whatever its shape. The
# way to the goal and the last action are transformed with them.

IMAGES = 8


class Images:
    """Replaces each of some transitions by a drawn image; image 0 is the original itself.

    Attributes:
        entry: (8, size) int64; entry n of image g is entry ``entry[g, n]`` of the original,
        sign: (8, size) float32, times this.
        action: (8, 6) int64 the image of each action.
    """

    def __init__(self) -> None:
        entry = np.zeros((IMAGES, OBSERVATION_SIZE), np.int64)
        sign = np.ones((IMAGES, OBSERVATION_SIZE), np.float32)
        action = np.zeros((IMAGES, ACTION_COUNT), np.int64)
        levels = np.arange(WINDOW_SIZE * len(SCALES)).reshape(len(SCALES), *WINDOW)
        goal = np.arange(WAY_SIZE).reshape(-1, 3) + levels.size
        for g, (swap, mirror_x, mirror_y) in enumerate(itertools.product((False, True), repeat=3)):
            window, way, moves = levels, goal, MOVES
            turns = np.ones(3, np.float32)
            if swap:
                window, way, moves = window.swapaxes(1, 2), way[:, [1, 0, 2]], moves[:, [1, 0, 2]]
            for axis, mirrored in enumerate((mirror_x, mirror_y)):
                if mirrored:
                    window = np.flip(window, axis + 1)
                    turns[axis] = -1.0
            image = [MOVES.tolist().index((move * turns.astype(np.int32)).tolist()) for move in moves]
            action[g] = image
            entry[g, : levels.size] = window.ravel()
            entry[g, levels.size : levels.size + WAY_SIZE] = way.ravel()
            sign[g, levels.size : levels.size + WAY_SIZE] = np.tile(turns, WAY_SIZE // 3)
            entry[g, levels.size + WAY_SIZE :] = np.argsort(image) + levels.size + WAY_SIZE
        self.entry, self.sign, self.action = (torch.from_numpy(table) for table in (entry, sign, action))

    def __call__(self, batch: Transitions, random: torch.Generator) -> Transitions:
        """Return one image of each transition, drawn evenly."""
        return self.of(batch, torch.randint(IMAGES, (len(batch.rows),), generator=random))

    def of(self, batch: Transitions, which: torch.Tensor) -> Transitions:
        """Return the images of some transitions; ``which`` is (N,) 0 .. 7."""
        entry, sign = self.entry[which], self.sign[which]
        return batch._replace(
            views=sign * batch.views.gather(1, entry),
            following=sign * batch.following.gather(1, entry),
            actions=self.action[which].gather(1, batch.actions),
        )


_Tester = Callable[[ValueNetwork, int], bool]
"""Tests a network after so many steps, and returns whether training may stop."""


def learn(
    spec: PaperSpec,
    config: PaperDqnConfig,
    test: _Tester,
    *,
    seed: int,
    budget: int,
    layouts: Sequence[PaperLayout] | None = None,
    initial: ValueNetwork | None = None,
) -> int:
    """Train until a test returns True or the budget is used up, and return the steps taken.

    A test runs every ``config.test_every`` steps and at the end of the budget. Training starts from the network
    ``initial`` if it is given, with ``config.exploration_again`` random actions. Episodes are drawn from ``layouts`` if
    they are given, otherwise as ``spec`` says. The same arguments give the same weights.
    """
    torch.set_num_threads(1)  # more threads slow down layers this small
    batch = BatchedPaperSite(
        spec,
        config.sites,
        observation=config.flat_observation,
        reward=config.reward,
        layouts=layouts,
        seed=seed,
        threads=1,
    )
    dqn = dqn_of_sites(batch, config, seed)
    if initial is not None:
        dqn.config = replace(config, exploration_first=config.exploration_again)
        dqn.begin_with(initial.tensors)
    tests = TestsAtIntervals(lambda steps: test(network_of(dqn), steps), config.test_every, budget)
    dqn.learn(budget, callback=tests)
    return int(dqn.num_timesteps)


def dqn_of_sites(batch: BatchedPaperSite, config: PaperDqnConfig, seed: int) -> BatchDqn:
    """Return a DQN over a batch of sites. The paper's map holds whole numbers, remembered as they are."""
    network = {"dueling": config.dueling, "glorot": config.glorot, "layer_norm": config.layer_norm}
    trained = Trained(
        PaperPolicy,
        {"network": network, "optimizer_kwargs": {"fused": True}},
        1 if config.observation == "paper" else 127,
        Images() if config.symmetry else None,
    )
    return BatchDqn(BatchVecEnv(batch), config, seed, trained)


def network_of(dqn: BatchDqn) -> ValueNetwork:
    """Return a copy of the network to test and to keep."""
    names = [name for name, _ in dqn.q_net.named_parameters()]
    return ValueNetwork(
        {name: tensor.detach().clone() for name, tensor in zip(names, dqn.tested_parameters(), strict=True)}
    )


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
