"""``bimvox train``: the site's policy, trained and stored (initialization layer)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pipeline.load_site import load_site
from pipeline.plan import prepared, seed_of
from pipeline.policy_choice import choose_policy
from pipeline.progress import Progress


def train(site: Path, *, steps: int | None = None, seed: int | None = None, progress: Progress) -> dict[str, Any]:
    """Train a site's policy from scratch and store it.

    Args:
        site: The site file.
        steps: Budget in environment steps; default: the site file's, else the built-in one.
        seed: Seed; default: the site file's.
        progress: Told of the stages.

    Returns:
        The document of ``bimvox train --json``.
    """
    loaded = load_site(site, progress)
    preparation = prepared(loaded.site, progress)
    wanted = loaded.config.policy
    policy = choose_policy(
        loaded.site,
        preparation,
        policy_id=None,
        seed=seed_of(loaded, seed),
        steps=steps if steps is not None else wanted.steps,
        required_success=wanted.required_success,
        progress=progress,
        retrain=True,
    )
    return {
        "policy": policy.id,
        "steps": policy.steps,
        "success_rate": policy.success_rate,
        "curve": [[point.steps, point.success_rate] for point in policy.curve],
        "seconds": sum(progress.seconds.values()),
        "stages": progress.seconds,
    }
