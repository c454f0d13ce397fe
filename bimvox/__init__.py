"""bimvox: from a building model to lifts a crane can execute.

The functions, each with values in and out; files are written only by ``write_log`` and ``render``:

>>> building = bimvox.read("tower.ifc")
>>> grid = bimvox.voxelize(building, 0.1)
>>> site = bimvox.guess_site(building)  # or bimvox.load_site("tower.site.toml")
>>> plan = bimvox.plan(site)
>>> plan.lifts[3].path_m, plan.to_dataframe()
>>> verdict = bimvox.verify(plan)  # or of a log's path
>>> plan = bimvox.revise(plan, "obstructions.json")
>>> bimvox.write_log(plan, "tower.mcap")
>>> bimvox.render(plan, "tower.png")

Every name is imported when it is first used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from bimvox.env.registration import register_with_gymnasium as _register_with_gymnasium
from bimvox.errors import BimvoxError
from bimvox.version import __version__

if TYPE_CHECKING:
    from bimvox.bim.building import Building
    from bimvox.grid.voxel_grid import VoxelGrid
    from bimvox.library.building import read, voxelize
    from bimvox.library.log import read_log, write_log
    from bimvox.library.plan import plan
    from bimvox.library.plan_value import LiftRow, Plan, PlannedLift
    from bimvox.library.render import render
    from bimvox.library.revise import revise
    from bimvox.library.site import LoadedSite, guess_site, load_site
    from bimvox.library.verify import verify
    from bimvox.records.proof import Check, Verification
    from bimvox.site.obstructions.obstruction_set import Box, Obstruction, ObstructionSet

__all__ = [
    "BimvoxError",
    "Box",
    "Building",
    "Check",
    "LiftRow",
    "LoadedSite",
    "Obstruction",
    "ObstructionSet",
    "Plan",
    "PlannedLift",
    "Verification",
    "VoxelGrid",
    "__version__",
    "guess_site",
    "load_site",
    "plan",
    "read",
    "read_log",
    "render",
    "revise",
    "verify",
    "voxelize",
    "write_log",
]

_HOME = {
    "Box": "bimvox.site.obstructions.obstruction_set",
    "Building": "bimvox.bim.building",
    "Check": "bimvox.records.proof",
    "LiftRow": "bimvox.library.plan_value",
    "LoadedSite": "bimvox.library.site",
    "Obstruction": "bimvox.site.obstructions.obstruction_set",
    "ObstructionSet": "bimvox.site.obstructions.obstruction_set",
    "Plan": "bimvox.library.plan_value",
    "PlannedLift": "bimvox.library.plan_value",
    "Verification": "bimvox.records.proof",
    "VoxelGrid": "bimvox.grid.voxel_grid",
    "guess_site": "bimvox.library.site",
    "load_site": "bimvox.library.site",
    "plan": "bimvox.library.plan",
    "read": "bimvox.library.building",
    "read_log": "bimvox.library.log",
    "render": "bimvox.library.render",
    "revise": "bimvox.library.revise",
    "verify": "bimvox.library.verify",
    "voxelize": "bimvox.library.building",
    "write_log": "bimvox.library.log",
}
"""The module of every name that is imported when it is first used."""


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'bimvox' has no attribute {name!r}")
    value = getattr(import_module(_HOME[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return list(__all__)


_register_with_gymnasium()
