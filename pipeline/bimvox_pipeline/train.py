"""``bimvox train``: the site's policy, trained and stored (initialization layer)."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bimvox.extras import require
from bimvox.files import write_atomically
from bimvox.library.hand_over import may_go_to_others
from bimvox.library.plan import seed_of
from bimvox.library.prove import prepared
from bimvox.library.site import load_site
from bimvox.policy.choice import DEFAULT_START, DEFAULT_STEPS, PolicyRequest, choose_policy
from bimvox.progress import Progress

if TYPE_CHECKING:
    from bimvox.policy.manifest import CurvePoint
    from bimvox.policy.tensorboard import TensorBoard


def train(  # noqa: PLR0913  (the options of a command)
    site: Path,
    *,
    steps: int | None = None,
    seed: int | None = None,
    start_from: str = DEFAULT_START,
    anyway: bool = False,
    seconds: float | None = None,
    curve: Path | None = None,
    tensorboard: Path | None = None,
    progress: Progress,
) -> dict[str, Any]:
    """Adapt a policy to a site and store it.

    Args:
        site: The site file.
        steps: Budget in environment steps; default: the site file's, otherwise the built-in one.
        seed: Seed; default: the site file's.
        start_from: ``default`` (the network that ships with bimvox), ``none`` (from scratch), ``nearest`` (the policy
            of the most similar site), or the id of a policy.
        anyway: Train even if that start is good enough.
        seconds: End the training at the first test after that.
        curve: CSV file for the curve: steps, success rate, mean path / shortest path.
        tensorboard: Folder for a TensorBoard log.
        progress: Receives the stages, and a note for every test: rate, steps a second, time left.

    Returns:
        The document of ``bimvox train --json``.

    Raises:
        MissingPackageError: If torch or stable-baselines3 is not installed.
    """
    require("train", "training")
    board = _board(tensorboard)
    loaded = load_site(site, progress)
    built, preparation = prepared(loaded.site, progress, free=may_go_to_others(loaded))
    loaded = replace(loaded, site=built)
    wanted = loaded.config.policy
    budget = steps if steps is not None else wanted.steps
    said = _Said(progress, budget if budget is not None else DEFAULT_STEPS)

    def tested(point: CurvePoint) -> None:
        said.test(point)
        if board is not None:
            board.point(point)

    request = PolicyRequest(
        seed=seed_of(loaded, seed),
        required_success=wanted.required_success,
        steps=said.budget,
        start_from=start_from,
        retrain=True,
        anyway=anyway,
        seconds=seconds,
    )
    policy = choose_policy(loaded.site, preparation, request, progress, tested)
    if board is not None:
        board.close()
    made = (start_from, seconds, said.budget, seed_of(loaded, seed))
    asked = (DEFAULT_START, None, DEFAULT_STEPS if wanted.steps is None else wanted.steps, wanted.seed)
    is_learned = policy.id != policy.parent
    if is_learned and made != asked:
        progress.note(
            f"a plan uses this policy only if named (--policy {policy.id}): the site file asks for another training"
        )
    if curve is not None:
        rows = [f"{p.steps},{p.success_rate:.6f},{p.length_ratio:.6f}" for p in policy.curve]
        write_atomically(curve, ("\n".join(["steps,success_rate,length_ratio", *rows]) + "\n").encode())
    return {
        "policy": policy.id,
        "learned": is_learned,
        "from": policy.parent,
        "steps": policy.steps,
        "success_rate": policy.success_rate,
        "tested": policy.tested,
        "success_at_least": round(policy.success_at_least, 4),
        "curve": [[point.steps, point.success_rate] for point in policy.curve],
        "seconds": sum(progress.seconds.values()),
        "stages": progress.seconds,
    }


def _board(folder: Path | None) -> TensorBoard | None:
    if folder is None:
        return None
    from bimvox.policy.tensorboard import TensorBoard

    return TensorBoard(folder)


class _Said:
    """Notes every test as a sentence."""

    def __init__(self, progress: Progress, budget: int) -> None:
        self._progress = progress
        self.budget = budget
        self._last: tuple[int, float] | None = None

    def test(self, point: CurvePoint) -> None:
        now = time.monotonic()
        pace = ""
        if self._last is not None and point.steps > self._last[0]:
            rate = (point.steps - self._last[0]) / max(1e-9, now - self._last[1])
            left = max(0.0, self.budget - point.steps) / rate
            pace = f", {rate:,.0f} steps a second, {left:,.0f} s left of the budget"
        self._last = (point.steps, now)
        self._progress.note(
            f"after {point.steps:,} steps: {point.success_rate:.1%} of the test lifts arrive, "
            f"{point.length_ratio:.3f} times the shortest way{pace}"
        )
