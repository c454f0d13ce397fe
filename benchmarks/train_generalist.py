"""``make train-generalist``: trains the network that ships with the package, from lessons to weights.

    python -m benchmarks.train_generalist --out bimvox/policy/weights

Deep Q-learning on thousands of random sites at once, and on lifts of the sample models. The recipe is for two cores
without an accelerator; the shipped network was trained with it.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from bimvox_pipeline.site import init
from numpy.typing import NDArray
from safetensors.numpy import save as bytes_from_arrays
from stable_baselines3.common.callbacks import BaseCallback

from bimvox.bim.options import ReadOptions
from bimvox.env.batched import BatchedLiftEnv
from bimvox.env.dynamics import StepLimit
from bimvox.env.observation import VIEW_NAME
from bimvox.env.pool import StartMix
from bimvox.env.problem import LiftProblem, training_problem
from bimvox.errors import PolicyError
from bimvox.library.site import load_site
from bimvox.planning.assembly import Assembly
from bimvox.planning.order_search import prepare
from bimvox.planning.rollout import Values
from bimvox.planning.stage import Stage
from bimvox.policy.config import DqnConfig
from bimvox.policy.dqn import device_named, dqn_of_lifts, network_of
from bimvox.policy.generalist.problems import (
    FAMILIES,
    LESSON_DOMAIN,
    SMALLEST,
    VALIDATION_DOMAIN,
    random_problem,
    with_boxes,
)
from bimvox.policy.generalist.weights import NAME
from bimvox.policy.network import QNetwork
from bimvox.policy.train import TEST_LIMIT, Evaluation, evaluate
from bimvox.progress import SilentProgress
from bimvox.site.collision import CollisionSpace
from bimvox.site.component import IntVec

STEPS, LESSONS, CHECKS = 1_200_000, 5_000, 300

RECIPE = DqnConfig(
    hidden=(256, 256, 128),
    learning_rate=1e-3,
    learning_rate_last=2e-5,
    cooling=0.5,
    batch_size=1024,
    buffer_size=300_000,
    learning_starts=5_000,
    lifts=256,
    gradient_steps=2,
    target_update=200,
    exploration_steps=30_000,
    exploration_last=0.4,
    exploration_spread=6.0,
    averaging=0.998,
    teacher=1.0,
    mix=StartMix(0.25, 0.15, 10),
    limit=StepLimit(3.0, 40),
    test_every=100_000,
)

SAMPLES = Path(__file__).parents[1] / "sample_models"
LESSON_MODELS = (("frame.ifc", 0.5), ("frame.ifc", 0.35), ("yard.stl", 0.5), ("yard.stl", 0.3))
"""Models and cell sizes (metres) of the lessons."""

TEST_MODELS = (("prefab.ifc", 0.5), ("prefab.ifc", 0.35))
"""Models and cell sizes (metres) of the tests; no lesson contains them."""

_LESSON_SIZES: tuple[tuple[IntVec, int], ...] = (((40, 40, 16), 3), ((96, 96, 32), 5), ((160, 160, 48), 2))
"""Largest site, and how many lessons in ten are drawn up to that size."""

_REWEIGH_EVERY = 100


@dataclass(frozen=True, slots=True)
class Check:
    """One test during the training.

    Attributes:
        steps: Environment steps so far.
        success_rate: Share of the check problems that were solved.
        length_ratio: Mean path / shortest path over the solved ones.
        by_family: Success rate of each family, in the order of ``FAMILIES``.
    """

    steps: int
    success_rate: float
    length_ratio: float
    by_family: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Run:
    """How a training runs.

    Attributes:
        seed: The same lessons, config, seed and device give the same weights.
        steps: Budget in environment steps.
        device: As torch names it.
        threads: For stepping the lifts.
        half: Whether to multiply in bfloat16.
    """

    seed: int = 0
    steps: int = STEPS
    device: str = "cpu"
    threads: int = 1
    half: bool = False


def main(arguments: list[str] | None = None) -> int:
    """Train, and write weights, record and curve."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.train_generalist", description=__doc__)
    parser.add_argument("--out", type=Path, required=True, help="folder for weights, record and curve")
    parser.add_argument("--device", default="cpu", help="as torch names it")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--lessons", type=int, default=LESSONS)
    parser.add_argument("--checks", type=int, default=CHECKS, help="problems for the tests during training")
    parser.add_argument("--steps", type=int, default=STEPS)
    parser.add_argument("--seed", type=int, default=0)
    chosen = parser.parse_args(arguments)
    try:
        device_named(chosen.device)
    except PolicyError as error:
        parser.error(str(error))
    began = time.monotonic()
    problems = lessons(chosen.lessons, threads=chosen.threads)
    problems += building_lifts(stages_of(LESSON_MODELS), count=chosen.lessons // 10, domain=1, starts=96)
    checks = lessons(chosen.checks, domain=VALIDATION_DOMAIN, threads=chosen.threads)
    _say(f"{len(problems)} lessons, {len(checks)} checks after {time.monotonic() - began:.0f} s")
    chosen.out.mkdir(parents=True, exist_ok=True)
    curve: list[Check] = []

    def report(check: Check, network: QNetwork) -> None:
        best = max(((one.success_rate, -one.length_ratio) for one in curve), default=(0.0, 0.0))
        curve.append(check)
        _say(
            f"{check.steps:>11,} steps {time.monotonic() - began:5.0f} s  success {check.success_rate:.3f}  "
            f"length {check.length_ratio:.4f}  " + " ".join(f"{n:.2f}" for n in check.by_family)
        )
        rows = [
            ",".join([str(one.steps), *(f"{n:.4f}" for n in (one.success_rate, one.length_ratio, *one.by_family))])
            for one in curve
        ]
        head = ",".join(["steps", "success_rate", "length_ratio", *FAMILIES])
        (chosen.out / "curve.csv").write_text("\n".join([head, *rows]) + "\n")
        if (check.success_rate, -check.length_ratio) >= best:
            record = {
                "config": RECIPE.to_dict(),
                "seed": chosen.seed,
                "steps": check.steps,
                "lessons": [0, chosen.lessons],
                "minutes": round((time.monotonic() - began) / 60, 1),
                "checks": chosen.checks,
                "budget_steps": chosen.steps,
                "device": chosen.device,
            }
            save_generalist(network, record, chosen.out)

    run = Run(chosen.seed, chosen.steps, chosen.device, chosen.threads, half=True)
    train_generalist(problems, checks, RECIPE, run, report=report)
    return 0


def _say(line: str) -> None:
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def lesson(number: int, domain: int = LESSON_DOMAIN) -> LiftProblem:
    """Return the problem of a number, which determines family, size and seed."""
    names = list(FAMILIES)
    sizes = [largest for largest, tenths in _LESSON_SIZES for _ in range(tenths)]
    largest = sizes[number // len(names) % len(sizes)]
    return random_problem((domain, number), names[number % len(names)], SMALLEST, largest)


def lessons(count: int, *, domain: int = LESSON_DOMAIN, first: int = 0, threads: int = 1) -> list[LiftProblem]:
    """Return ``count`` problems of a domain, from number ``first`` on, families in turn."""
    with ThreadPoolExecutor(threads) as executor:
        return list(executor.map(lambda number: lesson(number, domain), range(first, first + count)))


@dataclass(frozen=True, slots=True, eq=False)
class BuildingStage:
    """A building before one of its lifts.

    Attributes:
        space: The collision rule.
        start_vox: Cell where transit starts.
        gate_vox: Cell where it ends.
        yard_vox: (S, 3) int32 starts all over the yard.
    """

    space: CollisionSpace
    start_vox: IntVec
    gate_vox: IntVec
    yard_vox: NDArray[np.int32]


def building_lifts(stages: list[BuildingStage], *, count: int, domain: int, starts: int) -> list[LiftProblem]:
    """Return lifts at random stages of buildings, with random boxes in three of four.

    Args:
        stages: Of the buildings.
        count: Number of lifts; fewer if too many stages are unsolvable.
        domain: First number of their seeds.
        starts: Starts per lift, drawn from the yard.
    """
    problems: list[LiftProblem] = []
    for number in range(20 * count):
        if len(problems) == count or not stages:
            break
        rng = np.random.default_rng((domain, 99, number))
        stage = stages[int(rng.integers(len(stages)))]
        space = stage.space
        if rng.random() < 0.75:
            space = with_boxes(rng, space, int(rng.integers(1, 9)))
        problem = training_problem(
            space, stage.start_vox, stage.gate_vox, rng.permutation(stage.yard_vox)[: 4 * starts]
        )
        if len(problem.starts_vox):
            chosen = rng.permutation(problem.starts_vox)[:starts]
            first = (int(chosen[0, 0]), int(chosen[0, 1]), int(chosen[0, 2]))
            problems.append(LiftProblem(problem.space, first, stage.gate_vox, chosen, problem.distance))
    return problems


def save_generalist(network: QNetwork, record: dict[str, Any], folder: Path) -> str:
    """Write weights in half precision, and their record, and return their id.

    Args:
        network: The weights.
        record: Plain values: recipe, seed, steps, curve.
        folder: Where to.
    """
    folder.mkdir(parents=True, exist_ok=True)
    content = bytes_from_arrays({name: array.astype(np.float16) for name, array in network.arrays().items()})
    digest = hashlib.sha256(content).hexdigest()
    plain = {**record, "id": digest[:16], "weights_sha256": digest, "observation": VIEW_NAME}
    (folder / f"{NAME}.safetensors").write_bytes(content)
    (folder / f"{NAME}.json").write_text(json.dumps(plain, indent=1, sort_keys=True) + "\n")
    return digest[:16]


def stages_of(models: tuple[tuple[str, float], ...], folder: Path = SAMPLES) -> list[BuildingStage]:
    """Return the stages of models in their erection sequence, for lifts that can begin.

    Args:
        models: Names of files and cell sizes, metres.
        folder: Where the files are.
    """
    return [stage for name, size in models for stage in _stages(folder / name, size)]


def _stages(model: Path, voxel_size_m: float) -> list[BuildingStage]:
    progress = SilentProgress()
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "building.site.toml"
        options = ReadOptions(unit="m" if model.suffix == ".stl" else None)
        init(model, file, options=options, voxel_size_m=voxel_size_m, progress=progress)
        site = load_site(file, progress).site
    preparation = prepare(site)
    assembly = Assembly(site, preparation)
    yard = np.argwhere(site.yard).astype(np.int32)
    found = []
    for index in preparation.sequence.order:
        stage = assembly.begin_with_most(index)
        if isinstance(stage, Stage):
            starts = np.column_stack([yard, np.full(len(yard), stage.start_vox[2], np.int32)])
            found.append(BuildingStage(stage.space, stage.start_vox, stage.insertion.gate_vox, starts))
        assembly.finish(index, placed=preparation.places[index] is not None)
    return found


def train_generalist(
    problems: Sequence[LiftProblem],
    checks: Sequence[LiftProblem],
    config: DqnConfig,
    run: Run,
    *,
    families: int = len(FAMILIES),
    report: Callable[[Check, QNetwork], None] | None = None,
) -> QNetwork:
    """Train the generalist and return its last network (averaged).

    Args:
        problems: The lessons.
        checks: Problems of the tests during training, families in turn; never learned from.
        config: The choices.
        run: Seed, budget and machine.
        families: Number of families that take turns in ``checks``.
        report: Called with every check.
    """
    batch = BatchedLiftEnv(
        problems,
        config.lifts,
        reward_name=config.reward,
        mix=config.mix,
        limit=config.limit,
        seed=run.seed,
        threads=run.threads,
        teacher_discount=config.discount if config.teacher else 0.0,
    )
    torch.set_num_threads(run.threads)
    torch.set_float32_matmul_precision("high")
    dqn = dqn_of_lifts(batch, config, run.seed, device=run.device, half=run.half)

    def check(steps_done: int) -> None:
        network = network_of(dqn)
        found = _evaluate_in_parallel(network, checks, run.threads)
        by_family = tuple(float(found.arrived[n::families].mean()) for n in range(families))
        if report is not None:
            report(Check(steps_done, found.success_rate, found.length_ratio, by_family), network)

    checks_done = _Checks(batch, check, config.test_every)
    dqn.learn(run.steps, callback=checks_done)
    if checks_done.last != dqn.num_timesteps:
        check(dqn.num_timesteps)
    return network_of(dqn)


def _evaluate_in_parallel(values: Values, problems: Sequence[LiftProblem], threads: int = 1) -> Evaluation:
    """Return the roll-outs of a policy on each problem from its first start, on several threads."""
    single = [
        LiftProblem(p.space, p.start_vox, p.target_vox, np.array([p.start_vox], np.int32), p.distance) for p in problems
    ]
    parts = np.array_split(np.arange(len(single)), min(len(single), max(1, 4 * threads)))

    def work(part: NDArray[np.int64]) -> Evaluation:
        return evaluate(values, [single[n] for n in part], starts=len(part), limit=TEST_LIMIT)

    with ThreadPoolExecutor(threads) as executor:
        found = list(executor.map(work, parts))
    return Evaluation(
        np.arange(len(single)),
        np.concatenate([e.arrived for e in found]),
        np.concatenate([e.moves for e in found]),
        np.concatenate([e.shortest for e in found]),
    )


class _Checks(BaseCallback):
    """Runs the tests, and draws lessons more often that fail more often."""

    def __init__(self, batch: BatchedLiftEnv, check: Callable[[int], None], every: int) -> None:
        super().__init__()
        self._batch, self._check, self._every = batch, check, every
        self._next = every
        self._tries = np.ones(batch.problems)
        self._failures = np.zeros(batch.problems)
        self._calls = 0
        self.last = 0

    def _on_step(self) -> bool:
        step = self.training_env.last_step  # type: ignore[attr-defined]
        ended = step.ended
        self._tries += np.bincount(self._batch.ended_problem[ended], minlength=self._tries.size)
        failed = ended & ~step.terminated
        self._failures += np.bincount(self._batch.ended_problem[failed], minlength=self._tries.size)
        self._calls += 1
        if self._calls % _REWEIGH_EVERY == 0:
            self._batch.weigh_problems(1.0 + 4.0 * self._failures / self._tries)
            self._tries = 0.9 * self._tries + 0.1
            self._failures *= 0.9
        if self.num_timesteps >= self._next:
            self._next += self._every
            self._check(self.num_timesteps)
            self.last = self.num_timesteps
        return True


if __name__ == "__main__":
    sys.exit(main())
