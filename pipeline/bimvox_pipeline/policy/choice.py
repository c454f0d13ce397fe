"""Which policy a site uses: the one that was named, the one trained for it before, or one trained now."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from bimvox.errors import PolicyError
from bimvox_pipeline.progress import Progress

if TYPE_CHECKING:
    from collections.abc import Callable, Collection

    from bimvox.env.problem import LiftProblem
    from bimvox.planning.assembly import Preparation
    from bimvox.policy.config import DqnConfig
    from bimvox.policy.manifest import PolicyManifest
    from bimvox.policy.network import QNetwork
    from bimvox.policy.trained import CurvePoint, TrainedPolicy
    from bimvox.site.site import Site
    from bimvox_pipeline.train.record import Checkpoint

DEFAULT_STEPS = 40_000
"""Training budget in environment steps, where neither the site file nor the command says."""

RETRAINING_STARTS = 32
"""Of a test while a policy is retrained on a change: to compare it with the old one, the failed lifts among them."""

DEFAULT_START = "default"
"""Names the policy that ships with bimvox."""

NEAREST = "nearest"
"""Names the stored policy of the site most like this one."""


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
        tested: Starts of its last test.
        parent: Id of the policy that its training began from.
    """

    id: str
    loaded: bool
    steps: int
    success_rate: float
    curve: tuple[CurvePoint, ...]
    network: QNetwork | None
    tested: int = 0
    parent: str | None = None

    @property
    def success_at_least(self) -> float:
        """What the success rate from any start of the site is at least, with 95 % confidence."""
        from bimvox.policy.evaluate import success_at_least

        if self.tested == 0:
            return 0.0
        return success_at_least(round(self.success_rate * self.tested), self.tested)

    def to_dict(self) -> dict[str, Any]:
        """Return what the JSON documents say of it."""
        return {
            "id": self.id,
            "loaded": self.loaded,
            "from": self.parent,
            "steps": self.steps,
            "success_rate": self.success_rate if self.tested else None,
            "tested": self.tested,
            "success_at_least": round(self.success_at_least, 4),
        }


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
    start_from: str = DEFAULT_START,
    seconds: float | None = None,
    tested: Callable[[CurvePoint], None] | None = None,
) -> PolicyInUse:
    """Return the policy for a site, trained now if there is none.

    Training begins with the policy that ships with bimvox, which knows sites that it has never seen; where that is good
    enough here it is taken as it is. A stored policy serves without being named only where training now would give the
    same one (:func:`_would_be`), so what a store holds changes nothing but the time it takes.

    Args:
        site: The site.
        preparation: What was prepared for it.
        policy_id: A policy of the store; named, it is taken as it is. ``none``: search alone; ``nearest``: that of the
            most similar site.
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
    from bimvox.policy.site_outline import outline_of

    if policy_id == NO_POLICY.id:
        return NO_POLICY
    if policy_id == NEAREST:
        return _nearest(site, progress)
    if policy_id is not None:
        return _stored(policy_id)
    budget = DEFAULT_STEPS if steps is None else steps
    config = DqnConfig(required_success=required_success)
    initial, parent = _beginning(start_from)
    if initial is not None:
        config = adapting(config, initial.layer_sizes[1:-1])
    if not retrain:
        for manifest in store.find(site.geometry_digest):
            if _would_be(manifest, config, seed, parent, budget):
                return _stored(manifest.id)
    from bimvox_pipeline.train.record import Checkpoint
    from bimvox_pipeline.train.site_lessons import training_problems

    problems = training_problems(site, preparation, seed, progress)
    checkpoint = Checkpoint(site.geometry_digest, config, seed, parent, budget)
    policy = _trained(
        problems,
        config,
        seed,
        budget,
        initial,
        parent,
        progress,
        seconds=seconds,
        tested=tested,
        checkpoint=checkpoint,
    )
    policy_id = store.save(policy, site.geometry_digest, site=outline_of(site))
    checkpoint.remove()
    return _in_use(policy_id, policy)


def retrained(
    site: Site,
    preparation: Preparation,
    policy: PolicyInUse,
    *,
    failed: Collection[int] = (),
    seed: int,
    steps: int,
    progress: Progress,
) -> PolicyInUse:
    """Return a site's policy after more training on the site as it is now, obstructions included.

    The old policy is tested first, on the same lifts; it is returned as it is where it is good enough, or where no
    network of this training is better. A better one is kept in the store, but is never used unasked: it belongs to
    these obstructions.

    Args:
        site: The changed site.
        preparation: What was prepared for it.
        policy: The policy in use.
        failed: Components whose lifts it failed; they are among the lessons.
        seed: Seed of the training.
        steps: Budget in environment steps: the same budget gives the same result.
        progress: Told of the stages.
    """
    from dataclasses import replace

    from bimvox.policy import store
    from bimvox.policy.config import DqnConfig, adapting
    from bimvox.policy.site_outline import outline_of
    from bimvox_pipeline.train.site_lessons import training_problems

    if policy.network is None:
        return policy
    config = replace(adapting(DqnConfig(), policy.network.layer_sizes[1:-1]), test_starts=RETRAINING_STARTS)
    problems = training_problems(site, preparation, seed, progress, as_it_is=True, surely=failed)
    found = _trained(problems, config, seed, steps, policy.network, policy.id, progress)
    if found.network is policy.network:
        return policy
    # Its lessons were this site with its obstructions: it is not what training on the geometry would give.
    found = replace(found, budget=None)
    return _in_use(store.save(found, site.geometry_digest, site=outline_of(site)), found)


def _would_be(manifest: PolicyManifest, config: DqnConfig, seed: int, parent: str | None, budget: int) -> bool:
    """Return whether training a site with these choices would give its stored policy.

    The same choices, seed, beginning and budget: the learning rate falls towards the budget's end, so another budget is
    another training, also where both stop before. Only a beginning that is good enough untrained is so with any.
    """
    if (manifest.config, manifest.seed, manifest.parent) != (config, seed, parent):
        return False
    good = manifest.success_rate >= config.required_success and manifest.length_ratio <= config.required_ratio
    return manifest.budget == budget or (manifest.steps == 0 and manifest.budget is not None and good)


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


def _nearest(site: Site, progress: Progress) -> PolicyInUse:
    """Return the stored policy of the site most like this one.

    Raises:
        PolicyError: The store holds no policy of any site.
    """
    from bimvox.policy import store
    from bimvox.policy.site_outline import outline_of

    near = store.nearest(outline_of(site))
    if not near:
        raise PolicyError(
            f"{store.store_folder()}: holds no policy of any site, so none is the nearest",
            hint="leave --policy out: the policy that ships with bimvox knows sites that it has never seen",
        )
    away, manifest = near[0]
    progress.note(f"policy {manifest.id} is of the nearest site: {away:.2f} away (0: the same, 1: little in common)")
    return _stored(manifest.id)


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
    problems: list[LiftProblem],
    config: DqnConfig,
    seed: int,
    budget: int,
    initial: QNetwork | None,
    parent: str | None,
    progress: Progress,
    *,
    seconds: float | None = None,
    tested: Callable[[CurvePoint], None] | None = None,
    checkpoint: Checkpoint | None = None,
) -> TrainedPolicy:
    from bimvox.policy.train import train

    resumed = checkpoint.load() if checkpoint is not None else None
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
        checkpoint=None if checkpoint is None else checkpoint.save,
    )
    progress.finish()
    return policy


def _in_use(policy_id: str, policy: TrainedPolicy) -> PolicyInUse:
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
