"""``python -m benchmarks.decision``: microseconds of one decision on one core, network and observation apart."""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

os.environ.setdefault("NUMBA_NUM_THREADS", "1")

import numpy as np
from numpy.typing import NDArray

from benchmarks.document import put_into
from bimvox.compiled import kernel
from bimvox.env.dynamics import LiftState
from bimvox.env.observation import VIEW_SIZE, look
from bimvox.planning.rollout import roll_out
from bimvox.policy.generalist.suite import held_out
from bimvox.policy.generalist.weights import load_generalist
from bimvox.site.collision import CollisionSpace

PROBLEMS = (("boxes", 2), ("slabs", 5), ("frames", 6), ("frames", 8))
TOGETHER = 64
_CALLS, _REPEATS = 100, 40


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="write the table into docs/data/generalist.txt")
    chosen = parser.parse_args()
    network = load_generalist()
    lines = [
        "| site | boxes of the part | observation, µs: median | network, µs: median | least "
        f"| a lift of {TOGETHER} together: median |",
        "|---|---|---|---|---|---|",
    ]
    for family, number in PROBLEMS:
        problem = held_out(family, number).problem
        path = roll_out(network, problem).path_vox
        views = np.zeros((TOGETHER, VIEW_SIZE), np.float32)
        target = np.array(problem.target_vox, np.int32)
        seen = _spent(partial(_look_often, problem.space, target, path, views, _CALLS)) / _CALLS
        alone = _spent(partial(_ask_often, network, views[:1].copy())) / _CALLS
        together = _spent(partial(network, views)) / TOGETHER
        size = " x ".join(map(str, problem.grid_shape))
        lines.append(
            f"| {size} | {len(problem.space.boxes)} | {np.median(seen):.0f} | {np.median(alone):.0f} "
            f"| {alone.min():.0f} | {np.median(together):.0f} |"
        )
    text = "\n".join(lines)
    sys.stdout.write(text + "\n")
    if chosen.write:
        put_into(Path("docs/data/generalist.txt"), "bench-decision", text)


@kernel
def _look_often(
    space: CollisionSpace, target: NDArray[np.int32], path: NDArray[np.int32], out: NDArray[np.float32], count: int
) -> None:
    for n in range(count):
        row = n % path.shape[0]
        state = LiftState(int(path[row, 0]), int(path[row, 1]), int(path[row, 2]), 0, row)
        look(space, target, state, path, out[n % out.shape[0]])


def _ask_often(network: Callable[[NDArray[np.float32]], object], view: NDArray[np.float32]) -> None:
    for _ in range(_CALLS):
        network(view)


def _spent(work: Callable[[], object]) -> NDArray[np.float64]:
    """Return microseconds of processor time of each of many runs."""
    work()
    spent = []
    for _ in range(_REPEATS):
        started_s = time.process_time()
        work()
        spent.append(time.process_time() - started_s)
    return np.array(spent) * 1e6


if __name__ == "__main__":
    main()
