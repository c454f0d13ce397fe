"""Measures one tool on one case, in a separate process on one core: ``python -m benchmarks.voxelize.worker``."""

from __future__ import annotations

import argparse
import json
import os
import signal
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.voxelize.case import Scene
from benchmarks.voxelize.memory import limit_memory, peak_mb_of
from benchmarks.voxelize.office import office
from benchmarks.voxelize.tool import Voxelizer, make_voxelizer

# If the first run takes longer than this, it counts, because loading on first use is then negligible.
_LONG_S = 20.0
_QUICK_S = 2.0


def timed(tool: Voxelizer) -> tuple[float, float]:
    """Run a tool once and return its processor and wall time in seconds."""
    tool.forget()
    wall_s, cpu_s = time.perf_counter(), time.process_time()
    tool.run()
    return time.process_time() - cpu_s, time.perf_counter() - wall_s


def warm_up(key: str) -> None:
    """Load and compile what a tool needs, on a few parts that touch."""
    storey = office(1)
    tool = make_voxelizer(key, Scene.of(replace(storey, elements=storey.elements[:40]), 0.5))
    tool.run()
    tool.solid_cells()


def measure(key: str, scene_file: Path, out: Path, timeout_s: float) -> None:
    """Time a tool on a scene; write ``times.json`` and its answers in the scene's windows, ``masks.npz``.

    SIGPROF ends the process if the first run takes more than ``timeout_s`` seconds of processor time.
    """
    warm_up(key)
    scene, windows = Scene.load(scene_file)
    tool = make_voxelizer(key, scene)
    runs: list[tuple[float, float]] = []
    signal.setitimer(signal.ITIMER_PROF, timeout_s)
    memory_mb = peak_mb_of(lambda: runs.append(timed(tool)))
    signal.setitimer(signal.ITIMER_PROF, 0.0)
    first_s = runs[0][0]
    if first_s <= _LONG_S:
        runs = [timed(tool) for _ in range(5 if first_s < _QUICK_S else 3)]
    cpu_s, wall_s = zip(*runs, strict=True)
    found = {"cpu_s": cpu_s, "wall_s": wall_s, "memory_mb": memory_mb, "solid_cells": tool.solid_cells()}
    masks = {f"window{n}": np.packbits(tool.cells_in(window)) for n, window in enumerate(windows)}
    np.savez(out / "masks.npz", **masks)  # type: ignore[arg-type]  # the stubs take only `allow_pickle` by name
    (out / "times.json").write_text(json.dumps(found))


def main() -> None:
    """Parse the arguments and measure."""
    parser = argparse.ArgumentParser()
    parser.add_argument("tool")
    parser.add_argument("scene", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--memory-gb", type=float, required=True)
    parser.add_argument("--timeout", type=float, required=True)
    parser.add_argument("--compile", action="store_true", help="run once and write nothing")
    arguments = parser.parse_args()
    if sys.platform == "linux":
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    limit_memory(arguments.memory_gb)
    if arguments.compile:
        make_voxelizer(arguments.tool, Scene.load(arguments.scene)[0]).run()
        return
    measure(arguments.tool, arguments.scene, arguments.out, arguments.timeout)


if __name__ == "__main__":
    main()
