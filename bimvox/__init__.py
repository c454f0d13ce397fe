"""bimvox: from a building model to lifts a crane can execute.

The functions, each with values in and out; files are written only by ``write_log``, ``export`` and ``render``:

>>> building = bimvox.read("tower.ifc")
>>> grid = bimvox.voxelize(building, 0.1)
>>> site = bimvox.guess_site(building)  # or bimvox.load_site("tower.site.toml")
>>> plan = bimvox.plan(site)
>>> plan.lifts[3].path_m, plan.to_dataframe()
>>> verdict = bimvox.verify(plan)  # or of a log's path
>>> bimvox.optimise("tower.site.toml").front  # better set-ups, each planned
>>> plan = bimvox.revise(plan, "obstructions.json")
>>> bimvox.write_log(plan, "tower.mcap")
>>> bimvox.export(plan, "tower.csv")
>>> bimvox.render(plan, "tower.png")

Every name is imported when it is first used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from bimvox.env.gym import register_with_gymnasium as _register_with_gymnasium
from bimvox.errors import BimvoxError
from bimvox.version import __version__

if TYPE_CHECKING:
    from bimvox.bim.building import Building as Building
    from bimvox.bim.building import TriangleMesh as TriangleMesh
    from bimvox.grid.voxel_grid import VoxelGrid as VoxelGrid
    from bimvox.library.environment import lift_problems as lift_problems
    from bimvox.library.environment import live_job as live_job
    from bimvox.library.export import export as export
    from bimvox.library.optimise import SetUp as SetUp
    from bimvox.library.optimise import SetUps as SetUps
    from bimvox.library.optimise import optimise as optimise
    from bimvox.library.plan import plan as plan
    from bimvox.library.plan_value import LiftRow as LiftRow
    from bimvox.library.plan_value import Plan as Plan
    from bimvox.library.plan_value import PlannedLift as PlannedLift
    from bimvox.library.plan_value import read_log as read_log
    from bimvox.library.plan_value import write_log as write_log
    from bimvox.library.render import render as render
    from bimvox.library.revise import revise as revise
    from bimvox.library.sequences.suite import sequence_problems as sequence_problems
    from bimvox.library.site import LoadedSite as LoadedSite
    from bimvox.library.site import guess_site as guess_site
    from bimvox.library.site import load_site as load_site
    from bimvox.library.site import read as read
    from bimvox.library.site import voxelize as voxelize
    from bimvox.library.verify import verify as verify
    from bimvox.planning.given_order import PartToOrder as PartToOrder
    from bimvox.planning.lift_space import LiftSpace as LiftSpace
    from bimvox.records.proof import Check as Check
    from bimvox.records.proof import Verification as Verification
    from bimvox.site.obstructions.obstruction_set import Box as Box
    from bimvox.site.obstructions.obstruction_set import Cylinder as Cylinder
    from bimvox.site.obstructions.obstruction_set import Obstruction as Obstruction
    from bimvox.site.obstructions.obstruction_set import ObstructionSet as ObstructionSet
    from bimvox.site.obstructions.obstruction_set import Points as Points
    from bimvox.site.obstructions.obstruction_set import Voxels as Voxels

_HOME = {
    "Box": "bimvox.site.obstructions.obstruction_set",
    "Building": "bimvox.bim.building",
    "Check": "bimvox.records.proof",
    "Cylinder": "bimvox.site.obstructions.obstruction_set",
    "LiftRow": "bimvox.library.plan_value",
    "LiftSpace": "bimvox.planning.lift_space",
    "LoadedSite": "bimvox.library.site",
    "Obstruction": "bimvox.site.obstructions.obstruction_set",
    "ObstructionSet": "bimvox.site.obstructions.obstruction_set",
    "PartToOrder": "bimvox.planning.given_order",
    "Plan": "bimvox.library.plan_value",
    "PlannedLift": "bimvox.library.plan_value",
    "Points": "bimvox.site.obstructions.obstruction_set",
    "SetUp": "bimvox.library.optimise",
    "SetUps": "bimvox.library.optimise",
    "TriangleMesh": "bimvox.bim.building",
    "Verification": "bimvox.records.proof",
    "VoxelGrid": "bimvox.grid.voxel_grid",
    "Voxels": "bimvox.site.obstructions.obstruction_set",
    "export": "bimvox.library.export",
    "guess_site": "bimvox.library.site",
    "lift_problems": "bimvox.library.environment",
    "live_job": "bimvox.library.environment",
    "load_site": "bimvox.library.site",
    "optimise": "bimvox.library.optimise",
    "plan": "bimvox.library.plan",
    "read": "bimvox.library.site",
    "read_log": "bimvox.library.plan_value",
    "render": "bimvox.library.render",
    "revise": "bimvox.library.revise",
    "sequence_problems": "bimvox.library.sequences.suite",
    "verify": "bimvox.library.verify",
    "voxelize": "bimvox.library.site",
    "write_log": "bimvox.library.plan_value",
}
"""The module of every name that is imported when it is first used."""

__all__ = ["BimvoxError", "__version__", *_HOME]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'bimvox' has no attribute {name!r}")
    value = getattr(import_module(_HOME[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return list(__all__)


_register_with_gymnasium()
