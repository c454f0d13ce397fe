"""Which policy a site uses: the one that was named, the one trained for it before, or one trained now."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.progress import Progress

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bimvox.env.problem import LiftProblem
    from bimvox.planning.assembly import Preparation, Stage
    from bimvox.policy.network import QNetwork
    from bimvox.policy.trained import CurvePoint
    from bimvox.site.site import Site

DEFAULT_STEPS = 40_000
"""Training budget in environment steps, where neither the site file nor the command says."""

_PROBLEMS = 20
_PROBLEM_BYTES = 600_000_000  # tables and distance fields of all training problems together
_BYTES_A_CELL = 6  # int32 table, int16 distance
_STARTS = 256


@dataclass(frozen=True, slots=True, eq=False)
class PolicyInUse:
    """A policy, and where it came from.

    Attributes:
        id: Its id in the store.
        loaded: Whether it was in the store already.
        steps: Environment steps of its training.
        success_rate: In its last test.
        curve: Its tests.
        network: Its weights; None where search alone plans.
    """

    id: str
    loaded: bool
    steps: int
    success_rate: float
    curve: tuple[CurvePoint, ...]
    network: QNetwork | None

    def to_dict(self) -> dict[str, Any]:
        """Return what the JSON documents say of it."""
        return {"id": self.id, "loaded": self.loaded, "steps": self.steps, "success_rate": self.success_rate}


NO_POLICY = PolicyInUse("none", False, 0, 0.0, (), None)
"""Stands for planning by search alone: nothing is trained, loaded or asked."""


def choose_policy(
    site: Site,
    preparation: Preparation,
    *,
    policy_id: str | None,
    seed: int,
    steps: int | None,
    required_success: float,
    progress: Progress,
    retrain: bool = False,
) -> PolicyInUse:
    """Return the policy for a site, trained now if there is none.

    A stored policy serves without being named only where training now would give the same one: the same geometry, seed
    and choices, and a training that ended as this budget would have ended it.

    Args:
        site: The site.
        preparation: What was prepared for it.
        policy_id: A policy of the store; named, it is taken as it is. ``none``: search alone.
        seed: Seed of the training.
        steps: Budget in environment steps; None for the default.
        required_success: Success rate at which training stops.
        progress: Told of the stages.
        retrain: Train even where the store holds one.

    Raises:
        PolicyError: If the named policy is missing, damaged, or does not fit this version.
        PlanningError: If no lift of the site has a way to learn from.
    """
    from bimvox.policy import store
    from bimvox.policy.config import DqnConfig

    if policy_id == NO_POLICY.id:
        return NO_POLICY
    if policy_id is not None:
        return _stored(policy_id)
    budget = DEFAULT_STEPS if steps is None else steps
    config = DqnConfig(required_success=required_success)
    if not retrain:
        for manifest in store.find(site.geometry_digest):
            good = manifest.success_rate >= required_success and manifest.length_ratio <= config.required_ratio
            ended = good or manifest.steps >= budget
            if manifest.seed == seed and manifest.config == config and manifest.parent is None and ended:
                return _stored(manifest.id)
    return _trained(site, preparation, config, seed, budget, progress)


def _stored(policy_id: str) -> PolicyInUse:
    from bimvox.policy import store

    found = store.load(policy_id)
    manifest = found.manifest
    return PolicyInUse(manifest.id, True, manifest.steps, manifest.success_rate, tuple(manifest.curve), found.network)


def _trained(
    site: Site, preparation: Preparation, config: Any, seed: int, budget: int, progress: Progress
) -> PolicyInUse:
    problems = training_problems(site, preparation, seed, progress)
    from bimvox.policy import store
    from bimvox.policy.train import train

    progress.stage("train", budget)

    def tested(point: CurvePoint) -> None:
        progress.report("train", point.steps, budget)

    policy = train(problems, config, seed=seed, steps=budget, progress=tested)
    policy_id = store.save(policy, site.geometry_digest)
    progress.finish()
    return PolicyInUse(policy_id, False, policy.steps, policy.success_rate, policy.curve, policy.network)


def training_problems(site: Site, preparation: Preparation, seed: int, progress: Progress) -> list[LiftProblem]:
    """Return lifts to learn from, spread evenly over the order, each with starts all over the yard.

    Obstructions are left out: the policy's key is the site's geometry.

    Args:
        site: The site.
        preparation: What was prepared for it.
        seed: Chooses the starts.
        progress: Told of the stage.
    """
    from dataclasses import replace

    from bimvox.env.problem import training_problem
    from bimvox.planning.assembly import Assembly, Stage

    clear = replace(site, blockers=tuple(b for b in site.blockers if b.kind != "obstruction"))
    order = preparation.sequence.order
    most = max(2, _PROBLEM_BYTES // (_BYTES_A_CELL * int(np.prod(site.shape))))
    chosen = set(np.unique(np.linspace(0, len(order) - 1, min(len(order), most, _PROBLEMS)).round().astype(int)))
    rng = np.random.default_rng(seed)
    assembly = Assembly(clear, preparation)
    problems = []
    progress.stage("lessons", len(order))
    for number, index in enumerate(order):
        if number in chosen:
            stage = assembly.begin(index)
            if isinstance(stage, Stage):
                starts = _starts(clear, stage, rng)
                gate = stage.insertion.gate_vox
                problems.append(training_problem(stage.clearance, stage.start_vox, gate, starts))
        else:
            assembly.skip(index)
        assembly.finish(index, placed=preparation.places[index] is not None)
        progress.advance()
    return problems


def _starts(site: Site, stage: Stage, rng: np.random.Generator) -> NDArray[np.int32]:
    """Places over the whole yard, at the height at which transits start."""
    columns = np.argwhere(site.yard)
    if len(columns) > _STARTS:
        columns = columns[np.sort(rng.choice(len(columns), _STARTS, replace=False))]
    heights = np.full((len(columns), 1), stage.start_vox[2])
    starts: NDArray[np.int32] = np.concatenate([columns, heights], axis=1).astype(np.int32)
    return starts
