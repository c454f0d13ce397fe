"""``make train-generalist``: trains the policy that ships with the package, from lessons to weights.

``python -m bimvox_pipeline.train.generalist stages`` writes the stages of the sample buildings to a file and needs the
model reader; ``... train`` trains and needs only numpy, numba, torch and stable-baselines3.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bimvox.bim.options import ReadOptions
from bimvox.errors import InputError
from bimvox.progress import SilentProgress

if TYPE_CHECKING:
    from bimvox.policy.generalist.recipe import Check
    from bimvox.policy.generalist.stages import BuildingStage
    from bimvox.policy.network import QNetwork


def main(arguments: list[str] | None = None) -> int:
    """Run one of the two commands."""
    parser = argparse.ArgumentParser(prog="python -m bimvox_pipeline.train.generalist", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    stages = commands.add_parser("stages", help="write the stages of the sample buildings")
    stages.add_argument("file", type=Path)
    train = commands.add_parser("train", help="train and write the weights")
    train.add_argument("--stages", type=Path, help="file that `stages` wrote; default: read the sample buildings")
    train.add_argument("--out", type=Path, required=True, help="folder for weights, record and curve")
    train.add_argument("--device", default="cpu", help="as torch names it; cpu uses the recipe for two cores")
    train.add_argument("--threads", type=int, default=1)
    train.add_argument("--lessons", type=int)
    train.add_argument("--first-lesson", type=int, default=0, help="first lesson's number: not one of an earlier run")
    train.add_argument("--checks", type=int, help="problems for the tests during training")
    train.add_argument("--steps", type=int)
    train.add_argument("--seconds", type=float, help="time limit; the weights then depend on the speed of the machine")
    train.add_argument("--seed", type=int, default=0)
    train.add_argument("--from", dest="initial", type=Path, help="folder of weights to start from")
    chosen = parser.parse_args(arguments)
    try:
        if chosen.command == "stages":
            from bimvox.policy.generalist.stages import save_stages

            save_stages(chosen.file, stages_of(_LESSONS))
        else:
            _train(chosen)
    except InputError as error:
        parser.error(str(error))
    return 0


def _train(chosen: argparse.Namespace) -> None:
    from bimvox.policy.dqn import device_named
    from bimvox.policy.generalist import recipe
    from bimvox.policy.generalist.problems import FAMILIES, VALIDATION_DOMAIN, lessons
    from bimvox.policy.generalist.stages import building_lifts, load_stages
    from bimvox.policy.generalist.weights import generalist_record, load_generalist, save_generalist

    began = time.monotonic()
    small = device_named(chosen.device).type == "cpu"
    config = recipe.small_recipe() if small else recipe.RECIPE
    initial, before = None, []
    if chosen.initial:
        config = recipe.continuing(config)
        initial, earlier = load_generalist(chosen.initial), generalist_record(chosen.initial)
        before = [*earlier.pop("before", []), earlier]
    count = chosen.lessons or (recipe.SMALL_LESSON_COUNT if small else recipe.LESSON_COUNT)
    steps = chosen.steps or (recipe.SMALL_STEPS if small else recipe.STEPS)
    stages = stages_of(_LESSONS) if chosen.stages is None else load_stages(chosen.stages)
    problems = lessons(count, first=chosen.first_lesson, threads=chosen.threads)
    problems += building_lifts(stages, count=min(recipe.BUILDING_LIFTS, count // 10), domain=1, starts=96)
    check_count = chosen.checks or min(300 if small else recipe.CHECK_COUNT, count)
    checks = lessons(check_count, domain=VALIDATION_DOMAIN, threads=chosen.threads)
    _say(f"{len(problems)} lessons, {len(checks)} checks after {time.monotonic() - began:.0f} s")
    chosen.out.mkdir(parents=True, exist_ok=True)
    curve: list[list[float]] = []

    def report(check: Check, network: QNetwork) -> None:
        row = [check.steps, check.success_rate, check.length_ratio, *check.by_family]
        best = max((rank(earlier) for earlier in curve), default=(0.0, 0.0))
        curve.append([round(float(n), 4) for n in row])
        _say(
            f"{check.steps:>11,} steps {time.monotonic() - began:5.0f} s  success {check.success_rate:.3f}  "
            f"length {check.length_ratio:.4f}  " + " ".join(f"{n:.2f}" for n in check.by_family)
        )
        write_curve()
        if rank(curve[-1]) >= best:
            save(network)

    def rank(row: list[float]) -> tuple[float, float]:
        return row[1], -row[2]

    def write_curve() -> None:
        head = ",".join(["steps", "success_rate", "length_ratio", *FAMILIES])
        rows = [",".join([str(int(row[0])), *(f"{n:.4f}" for n in row[1:])]) for row in curve]
        (chosen.out / "curve.csv").write_text("\n".join([head, *rows]) + "\n")

    def save(network: QNetwork) -> None:
        record = {
            "config": config.to_dict(),
            "seed": chosen.seed,
            "steps": int(curve[-1][0]),
            "lessons": [chosen.first_lesson, chosen.first_lesson + count],
            "minutes": round((time.monotonic() - began) / 60, 1),
            "checks": check_count,
            "before": before,
            "budget_steps": steps,
            "device": chosen.device,
            "time_limited": chosen.seconds is not None,
        }
        save_generalist(network, record, chosen.out)

    left = None if chosen.seconds is None else chosen.seconds - (time.monotonic() - began)
    recipe.train_generalist(
        problems,
        checks,
        config,
        recipe.Run(chosen.seed, steps, left, chosen.device, chosen.threads, half=True),
        initial=initial,
        report=report,
    )


def _say(line: str) -> None:
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())


# The sample buildings of the generalist's lessons and tests, at every stage of their assembly.

_SAMPLES = Path(__file__).parents[3] / "sample_models"

_LESSONS = (("frame.ifc", 0.5), ("frame.ifc", 0.35), ("yard.stl", 0.5), ("yard.stl", 0.3))
"""Models and cell sizes (metres) of the lessons."""

TESTS = (("prefab.ifc", 0.5), ("prefab.ifc", 0.35))
"""Models and cell sizes (metres) of the tests; no lesson contains them."""


def stages_of(models: tuple[tuple[str, float], ...], folder: Path = _SAMPLES) -> list[BuildingStage]:
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
