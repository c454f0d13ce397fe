"""The ids of all environments, registered with Gymnasium when this module is imported; it imports nothing heavy.

Gymnasium knows the ids after ``import bimvox``. Without it, the id must name the package::

    gymnasium.make("bimvox:bimvox/Lift-v0")

``bimvox/Lift-v0`` is one lift of a crane, ``bimvox/PrefabSite-v0`` the paper's experiment,
``bimvox/PrefabSiteObstructed-v0`` the same with one to three drawn obstructions, ``bimvox/PrefabFrame-v0`` four columns
and four beams, ``bimvox/LiveSite-v0`` the lifts of a crane among people and lorries.
"""

from __future__ import annotations

import gymnasium

PAPER_ENV_IDS: dict[str, str] = {
    "bimvox/PrefabSite-v0": "paper",
    "bimvox/PrefabSiteObstructed-v0": "obstructed",
    "bimvox/PrefabFrame-v0": "frame",
}
"""The ids of construction sites, each with the key of its site in ``bimvox.paper.env.presets.PRESETS``."""

LIFT_ENV_ID = "bimvox/Lift-v0"
LIVE_ENV_ID = "bimvox/LiveSite-v0"

REWARD_THRESHOLDS: dict[str, float] = {
    "bimvox/Lift-v0": 2.31,
    "bimvox/PrefabSite-v0": -7.36,
    "bimvox/PrefabSiteObstructed-v0": -7.53,
    "bimvox/PrefabFrame-v0": 251.0,
    "bimvox/LiveSite-v0": -25.1,
}
"""Mean return from which an environment with its default arguments counts as solved: that of a policy which always
arrives and needs 1.05 times the fewest moves. The optimum is 2.34, -6.92, -7.07 and 253. Of ``LiveSite-v0``: of one
that loses 20 % less time than the recommended rule; only who knows the future is known to do it."""


def register() -> None:
    """Register the ids with ``gymnasium.make`` and ``make_vec``; an environment is imported when it is made."""
    for env_id, site in PAPER_ENV_IDS.items():
        if env_id not in gymnasium.registry:
            gymnasium.register(
                env_id,
                entry_point="bimvox.paper.env.site_env:PaperSiteEnv",
                vector_entry_point="bimvox.paper.env.vector_env:PaperVectorEnv",
                reward_threshold=REWARD_THRESHOLDS[env_id],
                kwargs={"site": site},
            )
    if LIFT_ENV_ID not in gymnasium.registry:
        threshold = REWARD_THRESHOLDS[LIFT_ENV_ID]
        gymnasium.register(LIFT_ENV_ID, entry_point="bimvox.env.lift_env:LiftEnv", reward_threshold=threshold)
    if LIVE_ENV_ID not in gymnasium.registry:
        threshold = REWARD_THRESHOLDS[LIVE_ENV_ID]
        gymnasium.register(LIVE_ENV_ID, entry_point="bimvox.live.env:LiveSiteEnv", reward_threshold=threshold)


register()
