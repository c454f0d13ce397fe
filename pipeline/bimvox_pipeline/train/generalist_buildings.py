"""The sample buildings of the generalist's lessons and tests, at every stage of their assembly."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bimvox.bim.options import ReadOptions
from bimvox.progress import SilentProgress

if TYPE_CHECKING:
    from bimvox.policy.generalist.stages import BuildingStage

SAMPLES = Path(__file__).parents[3] / "sample_models"

LESSONS = (("frame.ifc", 0.5), ("frame.ifc", 0.35), ("yard.stl", 0.5), ("yard.stl", 0.3))
"""Models and cell sizes (metres) of the lessons."""

TESTS = (("prefab.ifc", 0.5), ("prefab.ifc", 0.35))
"""Models and cell sizes (metres) of the tests; no lesson contains them."""


def stages_of(models: tuple[tuple[str, float], ...], folder: Path = SAMPLES) -> list[BuildingStage]:
    """Return the stages of models in their erection sequence, for lifts that can begin.

    Args:
        models: Names of files and cell sizes, metres.
        folder: Where the files are.
    """
    return [stage for name, size in models for stage in _stages(folder / name, size)]


def _stages(model: Path, voxel_size_m: float) -> list[BuildingStage]:
    from bimvox.library.site import load_site
    from bimvox.planning.assembly import Assembly
    from bimvox.planning.order_search import prepare
    from bimvox.planning.stage import Stage
    from bimvox.policy.generalist.stages import BuildingStage
    from bimvox_pipeline.site import init

    progress = SilentProgress()
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "building.site.toml"
        options = ReadOptions(unit="m" if model.suffix == ".stl" else None)
        init(model, file, options=options, voxel_size_m=voxel_size_m, progress=progress)
        site = load_site(file, progress).site
    preparation = prepare(site)
    assembly = Assembly(site, preparation)
    yard = np.argwhere(site.yard).astype(np.int32)
    found = []
    for index in preparation.sequence.order:
        stage = assembly.begin_with_most(index)
        if isinstance(stage, Stage):
            starts = np.column_stack([yard, np.full(len(yard), stage.start_vox[2], np.int32)])
            found.append(BuildingStage(stage.space, stage.start_vox, stage.insertion.gate_vox, starts))
        assembly.finish(index, placed=preparation.places[index] is not None)
    return found
