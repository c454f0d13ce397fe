"""``make bench-many-lifts``: the table of docs/data/generalist.txt."""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable
from pathlib import Path

os.environ.setdefault("NUMBA_NUM_THREADS", "1")

import numpy as np

from benchmarks.document import put_into
from benchmarks.many_lifts import methods
from benchmarks.many_lifts.problems import BOXES, SHAPE, Problems, make

_METHODS: tuple[tuple[Callable[[Problems, int], methods.Result], float], ...] = (
    (methods.policy, 1.0),
    (methods.search, 1.0),
    (methods.ompl, 1.0),
    (methods.scikit_image, 0.04),
    (methods.pathfinding3d, 0.02),
)
"""Each method, and the share of the lifts that it is run on: slow methods get fewer."""


def main() -> None:
    """Run every installed method on the same lifts."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--lifts", type=int, default=500)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--write", action="store_true", help="write the table into docs/data/generalist.txt")
    options = parser.parse_args()
    lines: list[str] = []

    def say(line: str) -> None:
        lines.append(line)
        print(line, flush=True)

    problems = make(options.lifts, options.seed)
    shortest: list[int | None] = []
    say(f"{options.lifts} lifts on {'x'.join(map(str, SHAPE))}, {BOXES} boxes, seed {options.seed}, one thread\n")
    say("| method | lifts | found | moves / shortest | all, s | a lift: median, p95, max, ms | |")
    say("|---|---|---|---|---|---|---|")
    reference = methods.search(problems, options.lifts)
    shortest = reference.moves
    for method, share in _METHODS:
        count = max(1, round(share * options.lifts))
        try:
            result = reference if method is methods.search else method(problems, count)
        except ImportError as error:
            say(f"| {method.__name__} | not installed ({error.name}) | | | | | |")
            continue
        say(_row(result, shortest))
    if options.write:
        put_into(Path("docs/data/generalist.txt"), "bench-many-lifts", "\n".join(lines))


def _row(result: methods.Result, shortest: list[int | None]) -> str:
    count = len(result.found)
    chosen = np.unique(np.linspace(0, len(shortest) - 1, count).round().astype(int))
    ratios = [
        moves / best
        for moves, n in zip(result.moves, chosen, strict=True)
        if moves is not None and (best := shortest[n])
    ]
    ratio = f"{np.mean(ratios):.3f}" if ratios else "-"
    each = np.array(result.seconds) * 1e3
    if result.together:
        spread = f"{each[0] / count:.2f} on average"
    else:
        spread = ", ".join(f"{value:.1f}" for value in (np.median(each), np.quantile(each, 0.95), each.max()))
    total = f"{each.sum() / 1e3:.2f}" if count == len(shortest) else f"({each.mean() * len(shortest) / 1e3:.0f})"
    return f"| {result.name} | {count} | {sum(result.found)} | {ratio} | {total} | {spread} | {result.words} |"


if __name__ == "__main__":
    main()
