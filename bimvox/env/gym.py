"""The ids of all environments, registered with Gymnasium when this module is imported; nothing heavy comes with it.

    gymnasium.make("bimvox.env.gym:bimvox/PrefabSite-v0")

imports this module and makes the environment; after ``import bimvox.env.gym`` the id alone is enough.
``bimvox/PrefabSite-v0`` is the paper's experiment, ``bimvox/PrefabSiteObstructed-v0`` the same with one to three drawn
obstructions, ``bimvox/PrefabFrame-v0`` four columns and four beams, ``bimvox/Lift-v0`` one lift of a crane.
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


def register() -> None:
    """Make ``gymnasium.make`` and ``gymnasium.make_vec`` know the ids; what they name is imported when it is made."""
    for env_id, site in PAPER_ENV_IDS.items():
        if env_id not in gymnasium.registry:
            gymnasium.register(
                env_id,
                entry_point="bimvox.paper.rendering.environments:DrawnPaperSiteEnv",
                vector_entry_point="bimvox.paper.rendering.environments:DrawnPaperVectorEnv",
                kwargs={"site": site},
            )
    if LIFT_ENV_ID not in gymnasium.registry:
        gymnasium.register(LIFT_ENV_ID, entry_point="bimvox.env.lift_env:LiftEnv")


register()
