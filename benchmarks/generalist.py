"""``make bench-generalist``: the policy that ships with the package on its held-out suite.

Every problem is solved three times. *One way*: the network with its loop guards from start to target, detours cut, no
cell expanded. *As shipped*, like ``bimvox plan``: if that does not arrive, the same from target to start. *With
search*: if neither arrives, the search takes over.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.document import put_into
from bimvox.env.problem import LiftProblem, lift_problem
from bimvox.planning.rollout import roll_out, roll_out_all
from bimvox.planning.search import shortest_path
from bimvox.policy.evaluate import success_at_least
from bimvox.policy.generalist.occupancies import FAMILIES
from bimvox.policy.generalist.problems import HELD_OUT_DOMAIN
from bimvox.policy.generalist.stages import BuildingStage, building_lifts
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
from bimvox.policy.generalist.weights import FOLDER, generalist_record, load_generalist
from bimvox.policy.network import QNetwork

LEAST_SUCCESS, LEAST_SUCCESS_OF_A_FAMILY, LONGEST = 0.99, 0.97, 1.02
"""The bars."""

HEAD = "problems | one way: success | moves / shortest | as shipped: success | moves / shortest |"


@dataclass(frozen=True, slots=True)
class Row:
    """One problem.

    Attributes:
        shortest: Fewest moves; negative if there is no path.
        manhattan: Manhattan distance.
        one_way: Moves of the guarded roll-out from the start; None if it did not arrive.
        shipped: Moves of the package's path; None if it did not arrive.
        found: Whether the package found a path, by search if the policy did not.
    """

    shortest: int
    manhattan: int
    one_way: int | None
    shipped: int | None
    found: bool


def main() -> int:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--weights", type=Path, default=FOLDER, help="folder of the weights; default: the package's")
    parser.add_argument("--share", type=float, default=1.0, help="share of each family's problems")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--write", action="store_true", help="write the tables into docs/generalist.md")
    chosen = parser.parse_args()
    began = time.monotonic()
    text = _Text()
    _tables(text, load_generalist(chosen.weights), chosen.share, chosen.threads)
    policy = generalist_record(chosen.weights)["id"]
    text.say(f"\nPolicy {policy}; share of the suite {chosen.share:g}; {(time.monotonic() - began) / 60:.0f} minutes.")
    if chosen.write:
        put_into(Path("docs/generalist.md"), "bench-generalist", text.whole)
    return 0


def _tables(text: _Text, network: QNetwork, share: float, threads: int) -> None:
    executor = ThreadPoolExecutor(threads)

    def measured(make: Callable[[int], LiftProblem], count: int) -> list[Row]:
        return list(executor.map(lambda n: measure(network, make(n)), range(max(1, round(count * share)))))

    text.head("family")
    families: dict[str, list[Row]] = {}
    for family in FAMILIES:
        families[family] = measured(partial(_held_out, family), FAMILY_COUNT)
        text.line(family, families[family])
    text.line("**all five**", [row for rows in families.values() for row in rows])
    lifts = building_lifts(_stages(), count=BUILDING_COUNT, domain=HELD_OUT_DOMAIN, starts=1)
    text.line("a building", measured(lambda n: lifts[n], len(lifts)))
    text.say("")
    for name, moves in (("one way", _one_way), ("as shipped", _shipped)):
        text.say(_verdict(name, families, moves))
    no_way = measured(unsolvable, UNSOLVABLE_COUNT)
    right = sum(row.shipped is None and not row.found for row in no_way)
    solved = sum(row.found for rows in families.values() for row in rows)
    count = sum(len(rows) for rows in families.values())
    text.say(f"- with search: {solved} of {count} solvable solved, {right} of {len(no_way)} unsolvable called so")

    text.head("\ndetour (shortest - Manhattan), cells")
    everything = [row for rows in families.values() for row in rows]
    for low, high in ((0, 0), (1, 4), (5, 16), (17, 64), (65, 10**6)):
        some = [row for row in everything if low <= row.shortest - row.manhattan <= high]
        if some:
            text.line(f"{low} to {high}" if high < 10**6 else f"{low} and more", some)
    text.head("\nU-trap's width / widest window (224 cells)")
    for width in TRAP_SHARES:
        text.line(f"{width:g}", measured(partial(wide_trap, width), TRAP_COUNT))
    executor.shutdown()


def _held_out(family: str, number: int) -> LiftProblem:
    return held_out(family, number).problem


def _stages() -> list[BuildingStage]:
    from bimvox_pipeline.train.generalist_buildings import TESTS, stages_of

    return stages_of(TESTS)


def measure(network: QNetwork, problem: LiftProblem) -> Row:
    """Solve one problem by the three methods."""
    bare = lift_problem(problem.space, problem.start_vox, problem.target_vox)
    forth = roll_out_all(network, [bare], from_target=False)[0]
    shipped = forth if forth.arrived else roll_out(network, bare)
    found = shipped.arrived or shortest_path(bare.space, bare.start_vox, bare.target_vox).path_vox is not None
    return Row(
        problem.distance_from(problem.start_vox),
        int(np.abs(np.subtract(problem.start_vox, problem.target_vox)).sum()),
        len(forth.path_vox) - 1 if forth.arrived else None,
        len(shipped.path_vox) - 1 if shipped.arrived else None,
        found,
    )


def _one_way(row: Row) -> int | None:
    return row.one_way


def _shipped(row: Row) -> int | None:
    return row.shipped


def _ratios(rows: Sequence[Row], moves: Callable[[Row], int | None]) -> np.ndarray:
    """Return moves / shortest for the problems in which it arrived."""
    return np.array([made / row.shortest for row in rows if (made := moves(row)) is not None])


def _verdict(name: str, families: dict[str, list[Row]], moves: Callable[[Row], int | None]) -> str:
    """Return a sentence for each bar."""
    rows = [row for of_family in families.values() for row in of_family]
    ratios = _ratios(rows, moves)
    success = len(ratios) / len(rows)
    worst = min(families, key=lambda family: len(_ratios(families[family], moves)) / len(families[family]))
    worst_success = len(_ratios(families[worst], moves)) / len(families[worst])
    length = float(ratios.mean())
    least = success_at_least(len(ratios), len(rows))
    return (
        f"- {name}: {success:.2%}, at least {least:.2%} with 95 % confidence (bar {LEAST_SUCCESS:.0%}: "
        f"{_met(success >= LEAST_SUCCESS)}); {worst} {worst_success:.1%} (bar {LEAST_SUCCESS_OF_A_FAMILY:.0%}: "
        f"{_met(worst_success >= LEAST_SUCCESS_OF_A_FAMILY)}); moves / shortest {length:.4f} (bar {LONGEST}: "
        f"{_met(length <= LONGEST)})"
    )


def _met(held: bool) -> str:
    return "met" if held else "**not met**"


class _Text:
    """Prints lines immediately and collects them."""

    def __init__(self) -> None:
        self.whole = ""

    def say(self, line: str) -> None:
        self.whole += line + "\n"
        sys.stdout.write(line + "\n")
        sys.stdout.flush()

    def head(self, first: str) -> None:
        self.say(f"{first[: len(first) - len(first.lstrip())]}| {first.strip()} | {HEAD}")
        self.say("|---" * 6 + "|")

    def line(self, name: str, rows: Sequence[Row]) -> None:
        cells = [name, str(len(rows))]
        for moves in (_one_way, _shipped):
            ratios = _ratios(rows, moves)
            cells += [f"{len(ratios) / len(rows):.1%}", f"{ratios.mean():.4f}" if ratios.size else "-"]
        self.say("| " + " | ".join(cells) + " |")


if __name__ == "__main__":
    sys.exit(main())
