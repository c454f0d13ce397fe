"""Training a site's policy: deep Q-learning until its greedy roll-outs succeed.

A network to start from is tested before torch is imported; if it is good enough, torch is not needed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from bimvox.env.batched import BatchedLiftEnv
from bimvox.env.problem import LiftProblem, is_learnable
from bimvox.errors import PlanningError
from bimvox.policy.config import DqnConfig
from bimvox.policy.evaluate import TEST_LIMIT, Evaluation, evaluate
from bimvox.policy.network import QNetwork
from bimvox.policy.trained import FROM_SCRATCH, CurvePoint, TrainedPolicy, TrainingStart


def train(
    problems: Sequence[LiftProblem],
    config: DqnConfig,
    *,
    seed: int,
    steps: int,
    start: TrainingStart = FROM_SCRATCH,
    seconds: float | None = None,
    progress: Callable[[CurvePoint], None] | None = None,
    checkpoint: Callable[[TrainedPolicy], None] | None = None,
) -> TrainedPolicy:
    """Train one policy for all of a site's lifts.

    The best network tested is kept. Training stops when it is as good as ``config`` requires, or when the budget is
    used up.

    Args:
        problems: The lifts, made by ``training_problem``. Unsolvable ones are left out.
        config: The choices.
        seed: The same problems, config, seed and start give the same weights.
        steps: Budget in environment steps, summed over the lifts in parallel.
        start: Where training starts.
        seconds: Time limit, checked at every test; the result then depends on the machine. None: no time limit.
        progress: Called with every test.
        checkpoint: Called with the best policy so far after every test; pass it as ``start.resumed`` to resume. A
            resumed run differs from an uninterrupted one, because the replay memory is not kept.

    Raises:
        PlanningError: None of the problems can be solved.
    """
    learnable = [problem for problem in problems if is_learnable(problem)]
    if not learnable:
        raise PlanningError(
            f"none of {len(problems)} lifts has a path from the yard to its place, so there is nothing to learn",
            hint="bimvox plan reports what blocks each lift",
        )
    resumed = start.resumed
    budget = steps if seconds is None and resumed is None else None
    record = Record(learnable, config, seed, start.parent, budget, progress, checkpoint)
    first = resumed.network if resumed is not None else start.network
    if resumed is not None:
        record.resume(resumed)
    elif start.network is not None and record.test(start.network, 0):
        return record.policy
    done = resumed.steps if resumed is not None else 0
    if done >= steps:
        return record.policy
    import torch

    from bimvox.policy.dqn import LiftDqn, load_network
    from bimvox.policy.train_callback import Tests
    from bimvox.policy.vec_env import LiftVecEnv

    torch.set_num_threads(1)  # more threads slow down layers this small
    batch = BatchedLiftEnv(
        learnable, config.lifts, reward_name=config.reward, mix=config.mix, limit=config.limit, seed=seed
    )
    dqn = LiftDqn(LiftVecEnv(batch), config, seed)
    if first is not None:
        load_network(dqn, first)
    dqn.num_timesteps = done
    dqn.learn(steps - done, callback=Tests(record, batch, steps, done, seconds), reset_num_timesteps=False)
    return record.policy


class Record:
    """The tests so far and the best policy among them."""

    def __init__(
        self,
        problems: Sequence[LiftProblem],
        config: DqnConfig,
        seed: int,
        parent: str | None,
        budget: int | None,
        progress: Callable[[CurvePoint], None] | None,
        checkpoint: Callable[[TrainedPolicy], None] | None,
    ) -> None:
        self._problems = problems
        self._config = config
        self._seed = seed
        self._parent = parent
        self._budget = budget
        self._progress = progress
        self._checkpoint = checkpoint
        self._curve: list[CurvePoint] = []
        self._best: tuple[CurvePoint, QNetwork, int] | None = None
        self.evaluation: Evaluation | None = None

    @property
    def policy(self) -> TrainedPolicy:
        """The best policy tested so far."""
        if self._best is None:
            raise RuntimeError("no network was tested yet")
        point, network, tested = self._best
        return TrainedPolicy(
            network,
            tuple(self._curve),
            self._curve[-1].steps,
            point.success_rate,
            point.length_ratio,
            tested,
            self._config,
            self._seed,
            self._parent,
            self._budget,
        )

    def resume(self, checkpoint: TrainedPolicy) -> None:
        """Continue with the tests and the best policy of an interrupted training."""
        self._curve = list(checkpoint.curve)
        point = CurvePoint(checkpoint.steps, checkpoint.success_rate, checkpoint.length_ratio)
        self._best = (point, checkpoint.network, checkpoint.tested)

    def test(self, network: QNetwork, steps: int) -> bool:
        """Test a network and return whether it is good enough."""
        config = self._config
        if config.both_ways:
            self.evaluation = evaluate(
                network, self._problems, starts=config.test_starts, limit=TEST_LIMIT, both_ways=True
            )
        else:
            self.evaluation = evaluate(network, self._problems, starts=config.test_starts, limit=config.limit)
        point = CurvePoint(steps, self.evaluation.success_rate, self.evaluation.length_ratio)
        self._curve.append(point)
        if self._best is None or _rank(point) > _rank(self._best[0]):
            self._best = (point, network, self.evaluation.arrived.size)
        if self._progress is not None:
            self._progress(point)
        if self._checkpoint is not None:
            self._checkpoint(self.policy)
        return point.success_rate >= self._config.required_success and point.length_ratio <= self._config.required_ratio


def _rank(point: CurvePoint) -> tuple[float, float]:
    """Return the sort key of tested networks: higher success rate first, then shorter paths."""
    return (point.success_rate, -point.length_ratio)
