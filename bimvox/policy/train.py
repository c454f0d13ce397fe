"""Training a site's policy: deep Q-learning until its greedy roll-outs succeed.

A network to begin with is tested before torch is imported: where it is good enough, nothing needs it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from bimvox.env.batched import BatchedLiftEnv
from bimvox.env.problem import LiftProblem, is_learnable
from bimvox.errors import PlanningError
from bimvox.policy.config import DqnConfig
from bimvox.policy.evaluate import TEST_LIMIT, Evaluation, evaluate
from bimvox.policy.network import QNetwork
from bimvox.policy.trained import CurvePoint, TrainedPolicy


def train(
    problems: Sequence[LiftProblem],
    config: DqnConfig,
    *,
    seed: int,
    steps: int,
    initial: QNetwork | None = None,
    parent: str | None = None,
    resumed: TrainedPolicy | None = None,
    seconds: float | None = None,
    progress: Callable[[CurvePoint], None] | None = None,
    checkpoint: Callable[[TrainedPolicy], None] | None = None,
) -> TrainedPolicy:
    """Train one policy for all of a site's lifts.

    The best network tested is kept; training stops when it is as good as ``config`` requires, or when the budget is
    used up. With ``initial``, that network is tested first, and returned as it is where it is good enough.

    Args:
        problems: The lifts, made by ``training_problem``. Those that cannot be solved teach nothing and are left out.
        config: The choices.
        seed: Same problems, config, seed and initial network: the same weights.
        steps: Budget in environment steps, summed over the lifts that run side by side.
        initial: Network to begin from.
        parent: Its id, for the record.
        resumed: A checkpoint of a training with the same problems, config, seed and parent that was cut off: its steps
            count as used, its curve is continued.
        seconds: End at the first test after that; the result depends on the machine then. None: the budget alone.
        progress: Told of every test.
        checkpoint: Given the best policy so far after every test, to be handed back as ``resumed``. A resumed run is
            not identical to an unbroken one: the replay memory is not kept.

    Raises:
        PlanningError: None of the problems can be solved.
    """
    learnable = [problem for problem in problems if is_learnable(problem)]
    if not learnable:
        raise PlanningError(
            f"none of {len(problems)} lifts has a way from the yard to its place, so there is nothing to learn",
            hint="the search says for each lift what is in its way",
        )
    budget = steps if seconds is None and resumed is None else None
    record = Record(learnable, config, seed, parent, budget, progress, checkpoint)
    begin = resumed.network if resumed is not None else initial
    if resumed is not None:
        record.resume(resumed)
    elif initial is not None and record.test(initial, 0):
        return record.policy
    done = resumed.steps if resumed is not None else 0
    if done >= steps:
        return record.policy
    import torch

    from bimvox.policy.dqn import LiftDqn, load_network
    from bimvox.policy.train_callback import Tests
    from bimvox.policy.vec_env import LiftVecEnv

    torch.set_num_threads(1)  # more threads only get in each other's way on layers this small
    batch = BatchedLiftEnv(
        learnable, config.lifts, reward_name=config.reward, mix=config.mix, limit=config.limit, seed=seed
    )
    dqn = LiftDqn(LiftVecEnv(batch), config, seed)
    if begin is not None:
        load_network(dqn, begin)
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
        """Take up the tests and the best policy of a training that was cut off."""
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
    """Return what makes one tested network better than another: it succeeds oftener, then it goes straighter."""
    return (point.success_rate, -point.length_ratio)
