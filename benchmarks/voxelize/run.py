"""Runs every tool on every case in separate processes, and judges the results."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from importlib import metadata
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.voxelize.case import CaseSpec, Scene
from benchmarks.voxelize.oracle import Truth, window_truth
from benchmarks.voxelize.result import CaseResult, Row
from benchmarks.voxelize.sample import sample_windows
from benchmarks.voxelize.score import judge, unpacked
from benchmarks.voxelize.tool import OURS, PEERS, ToolInfo

_ROOT = Path(__file__).parents[2]
_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS", "VTK_SMP_MAX_THREADS")
# Wall-clock limit of all runs together, as a multiple of the processor time allowed for the first.
_WALL_LIMITS = 10.0


def run_case(spec: CaseSpec, *, timeout_s: float, memory_gb: float, say: Callable[[str], None]) -> CaseResult:
    """Measure all tools on a case.

    Args:
        spec: The case.
        timeout_s: A tool whose first run takes more processor time is stopped.
        memory_gb: Memory limit of a tool.
        say: Receives every step.
    """
    scene = Scene.of(spec.make(), spec.voxel_size_m)
    windows = sample_windows(scene, dense=spec.dense, count=spec.windows)
    started_s = time.perf_counter()
    truths = [window_truth(scene, window) for window in windows]
    judged = sum(truth.size for truth in truths)
    say(f"{spec.name}: oracle, {judged:,} cells in {time.perf_counter() - started_s:.0f} s")
    tools = [OURS, *(tool for tool in PEERS if tool.dense or not spec.dense)] if spec.peers else [OURS]
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        scene_file = Path(folder) / "scene.npz"
        scene.save(scene_file, windows)
        for tool in tools:
            row = _run_tool(tool, scene_file, truths, timeout_s=timeout_s, memory_gb=memory_gb)
            found = row.failure if row.median_s is None else f"{row.median_s:.3f} s, {row.memory_mb:.0f} MB"
            say(f"{spec.name}: {tool.title}: {found}")
            rows.append(row)
    return CaseResult(
        name=spec.name,
        voxel_size_m=spec.voxel_size_m,
        dense=spec.dense,
        parts=len(scene.parts),
        triangles=len(scene.faces),
        cells=int(np.prod(np.array(scene.shape, dtype=object))),
        windows=len(windows),
        judged_pairs=sum(len(window.parts) for window in windows),
        judged_cells=judged,
        undecided_cells=sum(int(np.count_nonzero(truth == Truth.EITHER)) for truth in truths),
        rows=tuple(rows),
    )


def _run_tool(
    tool: ToolInfo, scene_file: Path, truths: Sequence[NDArray[np.uint8]], *, timeout_s: float, memory_gb: float
) -> Row:
    try:
        version = metadata.version(tool.distribution)
    except metadata.PackageNotFoundError:
        return Row(tool, "", f"{tool.distribution} is not installed")
    command = [sys.executable, "-m", "benchmarks.voxelize.worker", tool.key, str(scene_file)]
    with tempfile.TemporaryDirectory() as folder:
        command += [folder, "--memory-gb", str(memory_gb), "--timeout", str(timeout_s)]
        environment = {**os.environ, **dict.fromkeys(_ONE_THREAD, "1")}
        if tool.key == OURS.key:
            # Kernels are compiled once per machine, on their first call, and then cached on disk.
            subprocess.run([*command, "--compile"], cwd=_ROOT, env=environment, capture_output=True, check=False)
        try:
            done = subprocess.run(
                command,
                cwd=_ROOT,
                env=environment,
                capture_output=True,
                text=True,
                timeout=_WALL_LIMITS * timeout_s,
                check=False,
            )
        except subprocess.TimeoutExpired:
            return Row(tool, version, "hung, stopped")
        if done.returncode == -signal.SIGPROF:
            return Row(tool, version, f"over {timeout_s:.0f} s, stopped", timeout_s=timeout_s)
        if done.returncode != 0:
            return Row(tool, version, _reason(done, memory_gb))
        found = json.loads((Path(folder) / "times.json").read_text())
        with np.load(Path(folder) / "masks.npz") as masks:
            answers = [unpacked(masks[f"window{n}"], tool, truth) for n, truth in enumerate(truths)]
    return Row(
        tool,
        version,
        cpu_s=tuple(found["cpu_s"]),
        wall_s=tuple(found["wall_s"]),
        memory_mb=found["memory_mb"],
        solid_cells=found["solid_cells"],
        score=judge(tool, truths, answers),
    )


def _reason(done: subprocess.CompletedProcess[str], memory_gb: float) -> str:
    """Return in one line why a tool failed."""
    lines = [line.strip() for line in done.stderr.splitlines() if line.strip()]
    last = lines[-1] if lines else f"ended with status {done.returncode}"
    if "MemoryError" in done.stderr or "bad_alloc" in done.stderr or "Unable to allocate" in done.stderr:
        return f"over {memory_gb:g} GB"
    if done.returncode < 0:
        return f"killed by signal {-done.returncode}"
    return last[:160]
