"""The ids of all environments, registered as soon as Gymnasium is imported: ``import bimvox`` need not import it.

Gymnasium 1.0 removed its plugin entry points: it knows the ids of a package only after the package's import. Without
``import bimvox``, the id must name the package::

    gymnasium.make("bimvox:bimvox/Lift-v0")

``bimvox/Lift-v0`` is one lift of a crane, ``bimvox/PrefabSite-v0`` the paper's experiment,
``bimvox/PrefabSiteObstructed-v0`` the same with one to three drawn obstructions, ``bimvox/PrefabFrame-v0`` four columns
and four beams, ``bimvox/LiveSite-v0`` the lifts of a crane among people and lorries.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from importlib.util import find_spec
from types import ModuleType
from typing import Any

PAPER_ENV_IDS: dict[str, str] = {
    "bimvox/PrefabSite-v0": "paper",
    "bimvox/PrefabSiteObstructed-v0": "obstructed",
    "bimvox/PrefabFrame-v0": "frame",
}
"""The ids of construction sites, each with the key of its site in ``bimvox.paper.env.spec.PRESETS``."""

LIFT_ENV_ID = "bimvox/Lift-v0"
LIVE_ENV_ID = "bimvox/LiveSite-v0"

_REWARD_THRESHOLDS: dict[str, float] = {
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
    import gymnasium

    how: dict[str, dict[str, Any]] = {
        env_id: {
            "entry_point": "bimvox.paper.env.site_env:PaperSiteEnv",
            "vector_entry_point": "bimvox.paper.env.site_env:PaperVectorEnv",
            "kwargs": {"site": site},
        }
        for env_id, site in PAPER_ENV_IDS.items()
    }
    how[LIFT_ENV_ID] = {
        "entry_point": "bimvox.env.lift_env:LiftEnv",
        "vector_entry_point": "bimvox.env.lift_vector_env:LiftVectorEnv",
    }
    how[LIVE_ENV_ID] = {"entry_point": "bimvox.live.env:LiveSiteEnv"}
    for env_id, values in how.items():
        if env_id not in gymnasium.registry:
            gymnasium.register(env_id, reward_threshold=_REWARD_THRESHOLDS[env_id], **values)


def register_with_gymnasium() -> None:
    """Register the ids now if Gymnasium is imported already, otherwise right after its import."""
    if "gymnasium" in sys.modules:
        register()
    elif not any(isinstance(finder, _Gymnasium) for finder in sys.meta_path):
        sys.meta_path.insert(0, _Gymnasium())


class _Gymnasium(MetaPathFinder):
    """Finds Gymnasium as Python does, and has the ids registered when its import is complete."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return the usual spec of Gymnasium with a loader that registers. None for all other modules."""
        if fullname != "gymnasium":
            return None
        sys.meta_path.remove(self)
        spec = find_spec(fullname)
        if spec is not None and spec.loader is not None:
            spec.loader = _ThenRegister(spec.loader)
        return spec


class _ThenRegister(Loader):
    """Loads a module with its own loader, then registers the ids."""

    def __init__(self, loader: Loader) -> None:
        self._loader = loader

    def create_module(self, spec: ModuleSpec) -> ModuleType | None:
        """Return what the module's own loader makes."""
        return self._loader.create_module(spec)

    def exec_module(self, module: ModuleType) -> None:
        """Run the module, give it its own loader back, and register the ids."""
        if module.__spec__ is not None:
            module.__spec__.loader = self._loader
        module.__loader__ = self._loader
        self._loader.exec_module(module)
        register()
