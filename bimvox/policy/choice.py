"""The policy for a site: the one named, one trained for it before, greedy values, or one trained now."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass, field, replace
from typing import Any

from bimvox.env.problem import LiftProblem
from bimvox.errors import PolicyError
from bimvox.extras import require
from bimvox.planning.external import External
from bimvox.planning.preparation import Preparation
from bimvox.planning.rollout import GREEDY, proposer
from bimvox.planning.stage import Propose
from bimvox.policy import store
from bimvox.policy.config import DqnConfig, adapting
from bimvox.policy.generalist.weights import generalist_record, load_generalist
from bimvox.policy.manifest import CurvePoint, PolicyManifest, TrainedPolicy, Training, TrainingStart, outline_of
from bimvox.policy.near import of_same_building
from bimvox.policy.network import QNetwork
from bimvox.policy.site_lessons import training_problems
from bimvox.policy.store import Checkpoint
from bimvox.policy.train import success_at_least, train
from bimvox.progress import Progress
from bimvox.site.site import Site

DEFAULT_STEPS = 40_000
"""Training budget in environment steps if neither the site file nor the caller gives one."""

RETRAINING_STARTS = 32
"""Starts of a test during retraining on a change; the failed lifts are among them."""

DEFAULT_START = "default"
"""Names the network that ships with bimvox."""

NEAREST = "nearest"
"""Names the stored policy of the most similar site."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class PolicyInUse(Training):
    """A policy, and where it came from.

    Attributes:
        id: Its id in the store, ``greedy`` or ``none``.
        loaded: Whether it was in the store already.
        network: Its weights. None for greedy values, and if the plan is made by search alone.
        shipped: Whether it is the network that ships with bimvox.
        distance: From the site for which it was trained, if that is another one (``manifest.distance``).
        note: Why it is taken, or which stored one is not, if this may surprise.
        external: Planners and policies that the caller brought, in the order in which they are asked, before it.
    """

    id: str
    loaded: bool = False
    network: QNetwork | None = field(default=None, repr=False)
    shipped: bool = False
    distance: float | None = None
    note: str | None = None
    external: tuple[External, ...] = field(default=(), repr=False)

    @property
    def propose(self) -> Propose | None:
        """What proposes the paths of a plan; None for search alone."""
        propose: Propose | None = None
        if self.id == GREEDY_POLICY.id:
            propose = proposer(GREEDY)
        elif self.network is not None:
            propose = proposer(self.network)
        for one in reversed(self.external):
            propose = replace(one, instead=propose)
        return propose

    @property
    def success_at_least(self) -> float:
        """Lower bound of the success rate from any start of the site, at 95 % confidence, 0..1."""
        if self.tested == 0:
            return 0.0
        return success_at_least(round(self.success_rate * self.tested), self.tested)

    def to_dict(self) -> dict[str, Any]:
        """Return what the JSON documents say about it."""
        return {
            "id": self.id,
            "loaded": self.loaded,
            "shipped": self.shipped,
            "from": self.parent,
            "steps": self.steps,
            "success_rate": self.success_rate if self.tested else None,
            "tested": self.tested,
            "success_at_least": round(self.success_at_least, 4),
            **({} if self.distance is None else {"distance": round(self.distance, 3)}),
            **({} if self.note is None else {"note": self.note}),
            **({"external": [one.name for one in self.external]} if self.external else {}),
        }


NO_POLICY = PolicyInUse(id="none")
"""Planning by search alone: nothing is trained or loaded."""

GREEDY_POLICY = PolicyInUse(id="greedy")
"""Greedy values, towards the target, under the loop guard: nothing is trained or loaded."""


@dataclass(frozen=True, slots=True)
class PolicyRequest:
    """Which policy is wanted, and how one is trained if the store has none.

    Attributes:
        seed: Seed of the training.
        required_success: Success rate at which the training stops, 0..1.
        policy_id: Id of a stored policy, used unchanged; ``none``: search alone; ``greedy``: towards the target;
            ``nearest``: the policy of the most similar site; ``default``: the network that ships with bimvox. None: a
            stored policy that this training would give; if there is none, greedy values, or after training the trained
            one.
        steps: Training budget in environment steps.
        start_from: ``default`` (the network that ships with bimvox), ``none`` (from scratch), ``nearest`` (the policy
            of the most similar site), or the id of a policy.
        train: Whether to test the shipped network on the site, and to train if it is not good enough, when the store
            holds none. Otherwise nothing is tested and nothing is trained.
        retrain: Whether to train even if the store holds a policy.
        anyway: Whether to train even if the initial network is good enough.
        seconds: The training stops at the first test after this time; the result then depends on the machine.
    """

    seed: int
    required_success: float
    policy_id: str | None = None
    steps: int = DEFAULT_STEPS
    start_from: str = DEFAULT_START
    train: bool = False
    retrain: bool = False
    anyway: bool = False
    seconds: float | None = None


@dataclass(frozen=True, slots=True)
class _Training:
    """One training, as far as its result depends on it: choices, seed, budget, initial network and its id."""

    config: DqnConfig
    seed: int
    budget: int
    initial: QNetwork | None
    parent: str | None


def choose_policy(
    site: Site,
    preparation: Preparation,
    wanted: PolicyRequest,
    progress: Progress,
    tested: Callable[[CurvePoint], None] | None = None,
) -> PolicyInUse:
    """Return the policy for a site: the one named, else one trained for it before, else greedy values.

    If training is wanted, it starts from the network that ships with bimvox; if no network of the training is better,
    that network is returned, and nothing is stored. A stored policy that is not named is used only if training now
    would give the same one (:func:`_would_be`), so of several stored policies it does not matter which came first. If
    there is none, that of the same building with its crane or yard moved a little is used, and a note says so.

    ``preparation``: its contacts, order and yard; ``tested``: called with every test of a training.

    Raises:
        PolicyError: If the named policy is missing, damaged, or does not fit this version.
        PlanningError: If no lift of the site has a way to learn from.
    """
    if wanted.policy_id == NO_POLICY.id:
        return NO_POLICY
    if wanted.policy_id == GREEDY_POLICY.id:
        return GREEDY_POLICY
    if wanted.policy_id == NEAREST:
        return _stored(_nearest(site, progress))
    if wanted.policy_id is not None:
        return _shipped() if _is_shipped(wanted.policy_id) else _stored(wanted.policy_id)
    config = DqnConfig(required_success=wanted.required_success)
    start_from = _nearest(site, progress) if wanted.start_from == NEAREST else wanted.start_from
    initial, parent = _beginning(start_from)
    if initial is not None:
        config = adapting(config, initial.layer_sizes[1:-1])
    training = _Training(config, wanted.seed, wanted.steps, initial, parent)
    trains = wanted.train or wanted.retrain
    if not wanted.retrain:
        for manifest in store.find(site.geometry_digest):
            if _would_be(manifest, training):
                return _stored(manifest.id)
    if not trains:
        found = _of_same_building(site, training)
        if found.note is not None:
            progress.note(f"policy: {found.note}")
        return found
    require("train", "training")
    problems = training_problems(site, preparation, wanted.seed, progress)
    checkpoint = Checkpoint(site.geometry_digest, config, wanted.seed, parent, wanted.steps)
    policy = _trained(
        problems,
        training,
        progress,
        seconds=wanted.seconds,
        tested=tested,
        checkpoint=checkpoint,
        anyway=wanted.anyway,
    )
    if parent is not None and initial is not None and policy.network.equals(initial):
        checkpoint.remove()
        progress.note(_nothing_learned(policy, parent))
        return replace(_in_use(parent, policy, loaded=True), shipped=_is_shipped(parent))
    policy_id = store.save(policy, site.geometry_digest, site=outline_of(site))
    checkpoint.remove()
    return _in_use(policy_id, policy)


def _nothing_learned(policy: TrainedPolicy, parent: str) -> str:
    """Return the sentence about a training that gave no new network."""
    start = f"policy {parent}" + (", the shipped network," if _is_shipped(parent) else "")
    rate = (
        f"{policy.success_rate:.1%} of {policy.tested} test lifts arrive, {policy.length_ratio:.3f} times the shortest"
    )
    if policy.steps == 0 and policy.config.is_passed_by(policy.success_rate, policy.length_ratio):
        return f"nothing was to be learned: {start} already passes ({rate}). No policy was stored"
    return f"after {policy.steps:,} steps no network is better than {start} at the start ({rate}). No policy was stored"


def _of_same_building(site: Site, training: _Training) -> PolicyInUse:
    """Return the policy of the same building with its crane or yard moved a little, otherwise greedy values.

    Its note says which policy it is, or which one a person may mean that was trained in another way.
    """
    near = [*((0.0, manifest) for manifest in store.find(site.geometry_digest)), *of_same_building(site)]
    for away, manifest in near:
        if _would_be(manifest, training):
            note = f"{manifest.id}, of nearly this site (distance {away:.2f}); its own: train --from {manifest.id}"
            return replace(_stored(manifest.id), distance=away, note=note)
    if not near:
        return GREEDY_POLICY
    manifest = near[0][1]
    which = "this site's" if manifest.geometry_key == site.geometry_digest else "nearly this site's"
    note = f"none stored as the site file asks for; {which}, trained otherwise: --policy {manifest.id}"
    return replace(GREEDY_POLICY, note=note)


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
    """Return a site's policy after more training on the site with its current obstructions.

    The training starts from its network; for greedy values, from the shipped one. That network is tested first, on the
    same lifts. The policy is returned unchanged if its network is good enough, or if no network of this training is
    better. A better one is stored, but used only if it is named, because it was trained with these obstructions.

    Args:
        site: The changed site.
        preparation: Its contacts, order and yard.
        policy: The policy in use.
        failed: Components whose lifts it failed; they are among the lessons.
        seed: Seed of the training.
        steps: Budget in environment steps: the same budget gives the same result.
        progress: Receives the stages.
    """
    before = _shipped() if policy.id == GREEDY_POLICY.id else policy
    if before.network is None:
        return policy
    config = replace(adapting(DqnConfig(), before.network.layer_sizes[1:-1]), test_starts=RETRAINING_STARTS)
    problems = training_problems(site, preparation, seed, progress, with_obstructions=True, surely=failed)
    found = _trained(problems, _Training(config, seed, steps, before.network, before.id), progress)
    if found.network is before.network:
        return policy
    # Its lessons were this site with its obstructions: training on the geometry would not give it.
    found = replace(found, budget=None)
    return _in_use(store.save(found, site.geometry_digest, site=outline_of(site)), found)


def _would_be(manifest: PolicyManifest, training: _Training) -> bool:
    """Return whether a training would give this stored policy.

    The same choices, seed, initial network and budget do: the learning rate falls towards the end of the budget, so
    another budget is another training, even if both stop early. An initial network that is good enough untrained is
    taken with any budget.
    """
    config = training.config
    if (manifest.config, manifest.seed, manifest.parent) != (config, training.seed, training.parent):
        return False
    good = config.is_passed_by(manifest.success_rate, manifest.length_ratio)
    return manifest.budget == training.budget or (manifest.steps == 0 and manifest.budget is not None and good)


def _beginning(start_from: str) -> tuple[QNetwork | None, str | None]:
    """Return the initial network and its id. Both are None from scratch."""
    if start_from == "none":
        return None, None
    if _is_shipped(start_from):
        return load_generalist(), str(generalist_record()["id"])
    found = store.load(start_from)
    return found.network, found.manifest.id


def _is_shipped(name: str) -> bool:
    """Return whether a name or an id is that of the network that ships with bimvox."""
    return name in (DEFAULT_START, str(generalist_record()["id"]))


def _nearest(site: Site, progress: Progress) -> str:
    """Return the id of the stored policy of the most similar site.

    Raises PolicyError: the store holds no policy of any site.
    """
    near = store.nearest(outline_of(site))
    if not near:
        raise PolicyError(
            f"{store.store_folder()}: the store holds no policy of any site, so there is no nearest one",
            hint="leave policy (--policy) out, or name default: the network that ships with bimvox",
        )
    away, manifest = near[0]
    progress.note(f"policy {manifest.id} of the nearest site: distance {away:.2f} (0: the same, 1: little in common)")
    return manifest.id


def _shipped() -> PolicyInUse:
    """Return the network that ships with bimvox, as it is."""
    record = generalist_record()
    network = load_generalist()
    return PolicyInUse(id=str(record["id"]), loaded=True, steps=int(record["steps"]), network=network, shipped=True)


def _stored(policy_id: str) -> PolicyInUse:
    found = store.load(policy_id)
    return _in_use(found.manifest.id, found.trained, loaded=True)


def _trained(
    problems: list[LiftProblem],
    training: _Training,
    progress: Progress,
    *,
    seconds: float | None = None,
    tested: Callable[[CurvePoint], None] | None = None,
    checkpoint: Checkpoint | None = None,
    anyway: bool = False,
) -> TrainedPolicy:
    resumed = checkpoint.load() if checkpoint is not None else None
    if resumed is not None:
        progress.note(f"resumed an interrupted training after {resumed.steps:,} steps")
    if training.initial is not None and resumed is None:
        progress.stage("test the policy")
    else:
        progress.stage("train", training.budget)

    def test(point: CurvePoint) -> None:
        progress.report("train", point.steps, training.budget)
        if tested is not None:
            tested(point)

    policy = train(
        problems,
        training.config,
        seed=training.seed,
        steps=training.budget,
        start=TrainingStart(training.initial, training.parent, resumed, anyway),
        seconds=seconds,
        progress=test,
        checkpoint=None if checkpoint is None else checkpoint.save,
    )
    progress.finish()
    return policy


def _in_use(policy_id: str, policy: TrainedPolicy, *, loaded: bool = False) -> PolicyInUse:
    return PolicyInUse(id=policy_id, loaded=loaded, network=policy.network, **policy.training())
