"""``make bench-generalist``: the policy that ships with the package on its held-out suite.

Greedy with the loop guard first, no search; then what the search makes of the rest, and of lifts that have no way.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

from bimvox.env.problem import LiftProblem, lift_problem
from bimvox.planning.rollout import roll_out
from bimvox.planning.search import shortest_path
from bimvox.policy.generalist.occupancies import FAMILIES
from bimvox.policy.generalist.suite import (
    BUILDING_COUNT,
    FAMILY_COUNT,
    TRAP_COUNT,
    TRAP_SHARES,
    UNSOLVABLE_COUNT,
    held_out,
    unsolvable,
    wide_trap,
)
from bimvox.policy.generalist.weights import load_generalist
from bimvox.policy.network import QNetwork

Row = tuple[bool, int, int, int, int, bool]
"""Arrived, moves, shortest, Manhattan distance, steps before loops were cut, whether the search found a way."""


def main() -> int:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--weights", type=Path, help="folder of other weights than the package's")
    parser.add_argument("--share", type=float, default=1.0, help="of each family's problems")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--skip-buildings", action="store_true", help="no model reader needed then")
    chosen = parser.parse_args()
    network = load_generalist(chosen.weights) if chosen.weights else load_generalist()
    executor = ThreadPoolExecutor(chosen.threads)

    def measured(make: Callable[[int], LiftProblem], count: int) -> list[Row]:
        return list(executor.map(lambda n: measure(network, make(n)), range(max(1, round(count * chosen.share)))))

    say("| family | problems | success | path / shortest | 95th percentile | with search |")
    say("|---|---|---|---|---|---|")
    everything: list[Row] = []
    for family in FAMILIES:
        rows = measured(lambda n, family=family: held_out(family, n).problem, FAMILY_COUNT)  # type: ignore[misc]
        everything += rows
        say(line(family, rows))
    if not chosen.skip_buildings:
        from bimvox.policy.generalist.lessons import HELD_OUT_DOMAIN
        from bimvox.policy.generalist.stages import building_lifts
        from pipeline.generalist_buildings import TESTS, stages_of

        lifts = building_lifts(stages_of(TESTS), count=BUILDING_COUNT, domain=HELD_OUT_DOMAIN, starts=1)
        rows = measured(lambda n: lifts[n], len(lifts))
        everything += rows
        say(line("buildings", rows))
    say(line("all", everything))
    say(
        "\n| detour (shortest - Manhattan), cells | problems | success | path / shortest | 95th percentile | with search |"
    )
    say("|---|---|---|---|---|---|")
    for low, high in ((0, 0), (1, 4), (5, 16), (17, 64), (65, 10**6)):
        some = [row for row in everything if low <= row[2] - row[3] <= high]
        if some:
            say(line(f"{low} to {high}" if high < 10**6 else f"{low} and more", some))
    say(
        "\n| U-trap's width / widest window (224) | problems | success | path / shortest | 95th percentile | with search |"
    )
    say("|---|---|---|---|---|---|")
    for share in TRAP_SHARES:
        say(line(f"{share:g}", measured(lambda n, share=share: wide_trap(share, n), TRAP_COUNT)))  # type: ignore[misc]
    rows = measured(unsolvable, UNSOLVABLE_COUNT)
    right = sum(not row[0] and not row[5] for row in rows)
    say(f"\nUnsolvable: {right} of {len(rows)} called so; the policy claims {sum(row[0] for row in rows)} of them.")
    return 0


def measure(network: QNetwork, problem: LiftProblem) -> Row:
    """Roll the policy out on one problem, and search where it did not arrive."""
    bare = lift_problem(problem.clearance, problem.start_vox, problem.target_vox)
    rollout = roll_out(network, bare)
    found = rollout.arrived or shortest_path(bare.clearance, bare.start_vox, bare.target_vox).path_vox is not None
    manhattan = int(np.abs(np.subtract(problem.start_vox, problem.target_vox)).sum())
    return (
        rollout.arrived,
        len(rollout.path_vox) - 1,
        problem.distance_from(problem.start_vox),
        manhattan,
        rollout.steps,
        found,
    )


def line(name: str, rows: Sequence[Row]) -> str:
    """Return a row of a table."""
    arrived = np.array([row[0] for row in rows])
    ratio = np.array([row[1] / row[2] for row in rows if row[0]])
    found = sum(row[5] for row in rows) / len(rows)
    if not ratio.size:
        return f"| {name} | {len(rows)} | {arrived.mean():.1%} | - | - | {found:.1%} |"
    return (
        f"| {name} | {len(rows)} | {arrived.mean():.1%} | {ratio.mean():.4f} | {np.quantile(ratio, 0.95):.3f} | "
        f"{found:.1%} |"
    )


def say(text: str) -> None:
    """Print a line at once."""
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
