"""Which policy a site uses: the one that was named, the one trained for it before, or one trained now."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from pipeline.progress import Progress

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from bimvox.env.problem import LiftProblem
    from bimvox.planning.assembly import Preparation, Stage
    from bimvox.policy.config import DqnConfig
    from bimvox.policy.network import QNetwork
    from bimvox.policy.trained import CurvePoint
    from bimvox.site.site import Site

DEFAULT_STEPS = 40_000
"""Training budget in environment steps, where neither the site file nor the command says."""

DEFAULT_START = "default"
"""Names the policy that ships with bimvox."""

_PROBLEMS = 20
_PROBLEM_BYTES = 600_000_000  # tables and distance fields of all training problems together
_BYTES_A_CELL = 6  # int32 table, int16 distance
_STARTS = 256
_MOST_BOXES = 6


@dataclass(frozen=True, slots=True, eq=False)
class PolicyInUse:
    """A policy, and where it came from.

    Attributes:
        id: Its id in the store.
        loaded: Whether it was in the store already.
        steps: Environment steps of its training.
        success_rate: In its last test.
        curve: Its tests.
        network: Its weights.
        tested: Starts of its last test.
        parent: Id of the policy that its training began from.
    """

    id: str
    loaded: bool
    steps: int
    success_rate: float
    curve: tuple[CurvePoint, ...]
    network: QNetwork
    tested: int = 0
    parent: str | None = None

    @property
    def success_at_least(self) -> float:
        """What the success rate from any start of the site is at least, with 95 % confidence."""
        from bimvox.policy.evaluate import success_at_least

        return success_at_least(round(self.success_rate * self.tested), self.tested)

    def to_dict(self) -> dict[str, Any]:
        """Return what the JSON documents say of it."""
        return {"id": self.id, "loaded": self.loaded, "steps": self.steps, "success_rate": self.success_rate}


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
    start_from: str = DEFAULT_START,
    seconds: float | None = None,
    tested: Callable[[CurvePoint], None] | None = None,
) -> PolicyInUse:
    """Return the policy for a site, trained now if there is none.

    Training begins with the policy that ships with bimvox, which knows sites that it has never seen; where that is good
    enough here it is taken as it is. A stored policy serves without being named only where training now would give the
    same one: the same geometry, seed, choices and beginning, and a training that ended as this budget would have ended
    it.

    Args:
        site: The site.
        preparation: What was prepared for it.
        policy_id: A policy of the store; named, it is taken as it is.
        seed: Seed of the training.
        steps: Budget in environment steps; None for the default.
        required_success: Success rate at which training stops.
        progress: Told of the stages.
        retrain: Train even where the store holds one.
        start_from: ``default`` (the policy that ships with bimvox), ``none`` (from scratch), or the id of a policy.
        seconds: End the training at the first test after that; the result depends on the machine then.
        tested: Told of every test of a training.

    Raises:
        PolicyError: If the named policy is missing, damaged, or does not fit this version.
        PlanningError: If no lift of the site has a way to learn from.
    """
    from bimvox.policy import store
    from bimvox.policy.config import DqnConfig, adapting

    if policy_id is not None:
        return _stored(policy_id)
    budget = DEFAULT_STEPS if steps is None else steps
    config = DqnConfig(required_success=required_success)
    initial, parent = _beginning(start_from)
    if initial is not None:
        config = adapting(config, initial.layer_sizes[1:-1])
    if not retrain:
        for manifest in store.find(site.geometry_digest):
            good = manifest.success_rate >= required_success and manifest.length_ratio <= config.required_ratio
            ended = good or manifest.steps >= budget
            if manifest.seed == seed and manifest.config == config and manifest.parent == parent and ended:
                return _stored(manifest.id)
    problems = training_problems(site, preparation, seed, progress)
    return _trained(site.geometry_digest, problems, config, seed, budget, initial, parent, seconds, progress, tested)


def retrained(
    site: Site, preparation: Preparation, policy: PolicyInUse, *, seed: int, steps: int, progress: Progress
) -> PolicyInUse:
    """Return a site's policy after more training on the site as it is now, obstructions included.

    The old policy is tested first, on the same lifts; it is returned as it is where it is good enough, or where no
    network of this training is better.

    Args:
        site: The changed site.
        preparation: What was prepared for it.
        policy: The policy in use.
        seed: Seed of the training.
        steps: Budget in environment steps: the same budget gives the same result.
        progress: Told of the stages.
    """
    from bimvox.policy.config import DqnConfig, adapting

    config = adapting(DqnConfig(), policy.network.layer_sizes[1:-1])
    problems = training_problems(site, preparation, seed, progress, as_it_is=True)
    found = _trained(
        site.geometry_digest, problems, config, seed, steps, policy.network, policy.id, None, progress, None
    )
    return policy if found.network is policy.network else found


def _beginning(start_from: str) -> tuple[QNetwork | None, str | None]:
    """Return the network to begin from and its id."""
    from bimvox.policy import store
    from bimvox.policy.generalist.weights import generalist_record, load_generalist

    if start_from == "none":
        return None, None
    if start_from == DEFAULT_START:
        return load_generalist(), str(generalist_record()["id"])
    found = store.load(start_from)
    return found.network, found.manifest.id


def _stored(policy_id: str) -> PolicyInUse:
    from bimvox.policy import store

    found = store.load(policy_id)
    manifest = found.manifest
    return PolicyInUse(
        manifest.id,
        True,
        manifest.steps,
        manifest.success_rate,
        tuple(manifest.curve),
        found.network,
        manifest.tested,
        manifest.parent,
    )


def _trained(
    geometry_key: str,
    problems: list[LiftProblem],
    config: DqnConfig,
    seed: int,
    budget: int,
    initial: QNetwork | None,
    parent: str | None,
    seconds: float | None,
    progress: Progress,
    tested: Callable[[CurvePoint], None] | None,
) -> PolicyInUse:
    from bimvox.policy import store
    from bimvox.policy.train import train
    from pipeline.train_record import Checkpoint

    checkpoint = Checkpoint(geometry_key, config, seed, parent)
    resumed = checkpoint.load()
    if resumed is not None:
        progress.note(f"resumed a training that was cut off after {resumed.steps:,} steps")
    progress.stage("train", budget)

    def test(point: CurvePoint) -> None:
        progress.report("train", point.steps, budget)
        if tested is not None:
            tested(point)

    policy = train(
        problems,
        config,
        seed=seed,
        steps=budget,
        initial=initial,
        parent=parent,
        resumed=resumed,
        seconds=seconds,
        progress=test,
        checkpoint=checkpoint.save,
    )
    policy_id = store.save(policy, geometry_key)
    checkpoint.remove()
    progress.finish()
    return PolicyInUse(
        policy_id,
        False,
        policy.steps,
        policy.success_rate,
        policy.curve,
        policy.network,
        policy.tested,
        policy.parent,
    )


def training_problems(
    site: Site, preparation: Preparation, seed: int, progress: Progress, *, as_it_is: bool = False
) -> list[LiftProblem]:
    """Return lifts to learn from, spread evenly over the order, each with starts all over the yard.

    The site's own obstructions are left out, because the policy's key is its geometry; half of the lifts have random
    boxes in their way instead.

    Args:
        site: The site.
        preparation: What was prepared for it.
        seed: Chooses the starts and the boxes.
        progress: Told of the stage.
        as_it_is: Learn the site with its own obstructions, and no other.
    """
    from dataclasses import replace

    from bimvox.env.problem import is_learnable, training_problem
    from bimvox.planning.assembly import Assembly, Stage
    from bimvox.policy.generalist.problems import with_boxes

    clear = site if as_it_is else replace(site, blockers=tuple(b for b in site.blockers if b.kind != "obstruction"))
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
                lift = training_problem(stage.clearance, stage.start_vox, gate, starts)
                if len(problems) % 2 and not as_it_is:
                    boxed = with_boxes(rng, stage.clearance, int(rng.integers(1, _MOST_BOXES + 1)))
                    other = training_problem(boxed, stage.start_vox, gate, starts)
                    lift = other if is_learnable(other) else lift
                problems.append(lift)
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
