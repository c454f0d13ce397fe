"""``make bench-generalist``: the shipped network and its baselines on the held-out suite, under the same guards.

Three ways to rate moves: random values, greedy values (towards the target) and the network. Each is measured *bare*
(the best free move, no guard), in a *plan's try* (the calm guard once), *one way* (up to four guards from the start)
and *as tested* (if none of these arrives, also from the target), all with detours cut.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np

from benchmarks.document import put_into
from benchmarks.rates import rate
from bimvox.env.actions import ACTION_COUNT
from bimvox.env.guard import CALM, Guard
from bimvox.env.problem import LiftProblem, lift_problem
from bimvox.planning.rollout import (
    GREEDY,
    PLAN_LIMIT,
    ROLLOUT_LIMIT,
    Rollout,
    TowardsTarget,
    Values,
    roll_out_all,
    roll_out_starts,
)
from bimvox.planning.search import shortest_path
from bimvox.planning.shorten_path import straightened
from bimvox.policy.generalist.problems import FAMILIES
from bimvox.policy.generalist.suite import UNSOLVABLE_COUNT, ProblemSet, problem_sets, unsolvable
from bimvox.policy.generalist.weights import FOLDER, generalist_record, load_generalist
from bimvox.policy.score import WITHOUT_A_WAY

LEAST_SUCCESS, LEAST_SUCCESS_OF_A_FAMILY, LONGEST = 0.99, 0.97, 1.02
"""The bars."""

BARE = Guard(factor=0.0, slack=-1, reach_vox=-2, cost=0.0, visit_cost=0.0)
"""No guard: the free move of the highest value."""

NAMES = ("random", "greedy", "network")
WAYS = ("bare", "plan's try", "one way", "as tested")
PAGE = Path("docs/generalist.md")
"""It shows the first table."""
TABLES = Path("docs/data/generalist.txt")
CURVE = Path("docs/data/generalist_moves.csv")
DETOURS = {
    "no detour": (0, 0),
    "detour of 1 to 4": (1, 4),
    "5 to 16": (5, 16),
    "17 to 64": (17, 64),
    "65 and more": (65, 10**6),
}
"""Fewest moves less the Manhattan distance, cells."""


Maker = Callable[[int], Values | TowardsTarget]
"""Returns values for the problem of a number."""


@dataclass(frozen=True, slots=True)
class Tried:
    """One problem tried in one way.

    Attributes:
        moves: Moves of the path with its detours cut; None if it did not arrive.
        made: Moves made, over all tries.
        cpu_s: Processor time.
    """

    moves: int | None
    made: int
    cpu_s: float


@dataclass(frozen=True, slots=True)
class Row:
    """One problem.

    Attributes:
        shortest: Fewest moves.
        manhattan: Manhattan distance.
        tried: By values and way.
        found_s: Processor time of a complete search for it.
    """

    shortest: int
    manhattan: int
    tried: Mapping[tuple[str, str], Tried]
    found_s: float


def main() -> int:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--weights", type=Path, default=FOLDER, help="folder of the weights; default: the package's")
    parser.add_argument("--share", type=float, default=1.0, help="share of each split")
    parser.add_argument("--random-share", type=float, default=0.2, help="the same for random values, which are slow")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--write", action="store_true", help="write the tables into docs, the curve too")
    chosen = parser.parse_args()
    began = time.process_time()
    text = _Text()
    every = {name: _values(name, chosen.weights) for name in NAMES}
    splits = _measured(every, chosen.share, chosen.random_share, chosen.threads)
    _tables(text, splits)
    closed = _closed(chosen.share, chosen.threads)
    policy, minutes = generalist_record(chosen.weights)["id"], (time.process_time() - began) / 60
    text.say(
        f"\nSearch calls {closed} unsolvable lifts so. Network {policy}; share of the suite {chosen.share:g}, of "
        f"random values {min(chosen.share, chosen.random_share):g}; {minutes:.0f} minutes of processor time."
    )
    if chosen.write:
        put_into(TABLES, "bench-generalist", text.whole)
        put_into(PAGE, "bench-generalist", text.whole.partition("\n\n")[0])
        CURVE.write_text(_curve_csv(splits))
    return 0


def _values(name: str, weights: Path) -> Maker:
    if name == "random":
        return _random
    values = load_generalist(weights) if name == "network" else GREEDY
    return lambda number: values


def _random(number: int) -> Values:
    rng = np.random.default_rng(number)
    return lambda observations: rng.random((len(observations), ACTION_COUNT), np.float32)


def _measured(every: Mapping[str, Maker], share: float, random_share: float, threads: int) -> dict[str, list[Row]]:
    """Return the rows of every split; each site is made once for all values and ways."""
    sets = {name: one for name, one in problem_sets().items() if name != WITHOUT_A_WAY}
    others = {name: values for name, values in every.items() if name != "random"}

    def one(of_set: ProblemSet, number: int) -> Row:
        compared = every if number < max(1, round(of_set.count * random_share)) else others
        return measure(compared, of_set.make(number), number)

    splits = {}
    measure(every, sets["boxes"].make(0), 0)  # compiles
    with ThreadPoolExecutor(threads) as executor:
        for name, of_set in sets.items():
            numbers = range(max(1, round(of_set.count * share)))
            splits[name] = list(executor.map(partial(one, of_set), numbers))
            sys.stderr.write(f"{name}: {len(splits[name])}\n")
    return splits


_WIDE = "wide-trap-"
_HOPELESS = 0.5
"""U-traps from this share of the widest window on are one row: nothing leaves them."""


def measure(every: Mapping[str, Maker], problem: LiftProblem, number: int) -> Row:
    """Solve one problem by all values in all ways."""
    lift = lift_problem(problem.space, problem.start_vox, problem.target_vox)
    tried = {
        (name, way): one for name, make in every.items() for way, one in tries(make(number), lift, name != "random")
    }
    began = time.thread_time()
    shortest_path(lift.space, lift.start_vox, lift.target_vox)
    manhattan = int(np.abs(np.subtract(lift.start_vox, lift.target_vox)).sum())
    return Row(problem.distance_from(problem.start_vox), manhattan, tried, time.thread_time() - began)


def tries(values: Values | TowardsTarget, lift: LiftProblem, both_ways: bool) -> Iterator[tuple[str, Tried]]:
    """Yield how values do on a lift, by way."""
    at, start = np.zeros(1, np.int64), np.array([lift.start_vox], np.int32)

    def once(guard: Guard) -> Rollout:
        (made,) = roll_out_starts(values, [lift], at, start, limit=PLAN_LIMIT, guard=guard)
        return Rollout(straightened(lift.space, made.path_vox), made.outcome, made.steps)

    def timed(roll: Callable[[], Rollout]) -> tuple[Rollout, Tried]:
        began = time.thread_time()
        made = roll()
        cpu_s = time.thread_time() - began
        return made, Tried(len(made.path_vox) - 1 if made.arrived else None, made.steps, cpu_s)

    yield "bare", timed(lambda: once(BARE))[1]
    yield "plan's try", timed(lambda: once(CALM))[1]
    # The curve: one calm try as long as a test allows.
    (calm,) = roll_out_starts(values, [lift], at, start, limit=ROLLOUT_LIMIT, guard=CALM)
    yield "calm", Tried(len(calm.path_vox) - 1 if calm.arrived else None, calm.steps, 0.0)
    forth, one_way = timed(lambda: roll_out_all(values, [lift], from_target=False)[0])
    yield "one way", one_way
    if both_ways:
        yield "as tested", one_way if forth.arrived else timed(lambda: roll_out_all(values, [lift])[0])[1]


def _closed(share: float, threads: int) -> str:
    """Return how many lifts without a path the search and greedy values under all guards call so."""

    def is_called_so(number: int) -> bool:
        problem = unsolvable(number)
        lift = lift_problem(problem.space, problem.start_vox, problem.target_vox)
        found = shortest_path(lift.space, lift.start_vox, lift.target_vox).path_vox
        return found is None and not roll_out_all(GREEDY, [lift])[0].arrived

    count = max(1, round(UNSOLVABLE_COUNT * share))
    with ThreadPoolExecutor(threads) as executor:
        return f"{sum(executor.map(is_called_so, range(count)))} of {count}"


def _tables(text: _Text, splits: Mapping[str, Sequence[Row]]) -> None:
    everything = [row for family in FAMILIES for row in splits[family]]
    text.head("values", "way", "success", "worst family", "moves / shortest", "moves made / distance", "ms a lift")
    for name, way in [("random", "one way"), *product(NAMES[1:], WAYS)]:
        text.line(name, way, *_summary(splits, name, way))
    found_ms = 1000.0 * float(np.mean([row.found_s for row in everything]))
    text.line("search", "complete", rate(len(everything), len(everything)), "100.0%", "1.0000", "-", f"{found_ms:.1f}")
    missed = [
        f"{name}, {way}: {told}" for name, way in product(NAMES[1:], WAYS[2:]) if (told := _missed(splits, name, way))
    ]
    bars = f"success {LEAST_SUCCESS:.0%}, worst family {LEAST_SUCCESS_OF_A_FAMILY:.0%}, moves / shortest {LONGEST}"
    text.say(f"\nBars for *one way* and *as tested* ({bars}) that are missed: {'; '.join(missed) or 'none'}.")

    asked = list(product(WAYS[1:3], NAMES[1:]))
    text.head("\nproblems", "number", *(f"{way}: {name}" for way, name in asked))
    for title, rows in _groups(splits, everything):
        shares = (f"{share_of(rows, name, way):.1%}" for way, name in asked)
        text.line(title, str(len(rows)), *shares)


def _groups(splits: Mapping[str, Sequence[Row]], everything: Sequence[Row]) -> Iterator[tuple[str, Sequence[Row]]]:
    """Yield the problems by split, by detour, and by the width of a U-trap."""
    yield from ((split, rows) for split, rows in splits.items() if not split.startswith(_WIDE))
    for title, (low, high) in DETOURS.items():
        some = [row for row in everything if low <= row.shortest - row.manhattan <= high]
        if some:
            yield title, some
    wide = {float(split.removeprefix(_WIDE)): rows for split, rows in splits.items() if split.startswith(_WIDE)}
    yield from ((f"U-trap {width:g}", rows) for width, rows in wide.items() if width < _HOPELESS)
    hopeless = [row for width, rows in wide.items() if width >= _HOPELESS for row in rows]
    yield f"U-trap {_HOPELESS:g} and more", hopeless


def _curves(row: Row) -> list[tuple[str, str]]:
    return [key for way in ("bare", "calm") for key in row.tried if key[1] == way]


def _tried(rows: Sequence[Row], name: str, way: str) -> list[Row]:
    """Return the rows on which these values were measured."""
    return [row for row in rows if (name, way) in row.tried]


def _arrived(rows: Sequence[Row], name: str, way: str) -> list[tuple[Row, int]]:
    """Return the rows that arrived, each with the moves of its path."""
    return [(row, moves) for row in _tried(rows, name, way) if (moves := row.tried[name, way].moves) is not None]


def rate_of(rows: Sequence[Row], name: str, way: str) -> str:
    """Return the share of the rows that arrived, with its interval."""
    return rate(len(_arrived(rows, name, way)), len(_tried(rows, name, way)))


def share_of(rows: Sequence[Row], name: str, way: str) -> float:
    """Return the share of the rows that arrived."""
    return len(_arrived(rows, name, way)) / len(_tried(rows, name, way))


def _summary(splits: Mapping[str, Sequence[Row]], name: str, way: str) -> Iterator[str]:
    """Return the cells of one line of the first table."""
    rows = [row for family in FAMILIES for row in splits[family]]
    yield rate_of(rows, name, way)
    yield f"{min(share_of(splits[family], name, way) for family in FAMILIES):.1%}"
    ratios = [moves / row.shortest for row, moves in _arrived(rows, name, way)]
    yield f"{np.mean(ratios):.4f}" if ratios else "-"
    yield f"{np.mean([row.tried[name, way].made / row.manhattan for row in _tried(rows, name, way)]):.1f}"
    yield f"{1000.0 * np.mean([row.tried[name, way].cpu_s for row in _tried(rows, name, way)]):.1f}"


def _missed(splits: Mapping[str, Sequence[Row]], name: str, way: str) -> str:
    """Return the bars that these values miss."""
    rows = [row for family in FAMILIES for row in splits[family]]
    arrived = _arrived(rows, name, way)
    held = {
        "success": len(arrived) / len(rows) >= LEAST_SUCCESS,
        "worst family": min(share_of(splits[one], name, way) for one in FAMILIES) >= LEAST_SUCCESS_OF_A_FAMILY,
        "moves / shortest": float(np.mean([moves / row.shortest for row, moves in arrived])) <= LONGEST,
    }
    return " and ".join(bar for bar, is_met in held.items() if not is_met)


def share_within(rows: Sequence[Row], name: str, way: str, budget: float) -> float | None:
    """Return the share that arrived within so many moves made per cell of distance; None beyond the way's limit."""
    if way == "bare" and budget > PLAN_LIMIT.factor:
        return None
    within = sum(row.tried[name, way].made <= budget * row.manhattan for row, _ in _arrived(rows, name, way))
    return within / len(_tried(rows, name, way))


def _curve_csv(splits: Mapping[str, Sequence[Row]]) -> str:
    """Return success against moves made, by split: a line for each values, way and budget."""
    lines = ["split,values,way,problems,moves_made_per_distance,success"]
    groups = {"all five": [row for family in FAMILIES for row in splits[family]], **splits}
    groups = {split: rows for split, rows in groups.items() if not split.startswith(_WIDE)}
    for split, rows in groups.items():
        for name, way in _curves(rows[0]):
            for budget in np.arange(1.0, 8.01, 0.25):
                share = share_within(rows, name, way, float(budget))
                if share is not None:
                    lines.append(f"{split},{name},{way},{len(_tried(rows, name, way))},{budget:g},{share:.4f}")
    return "\n".join(lines) + "\n"


class _Text:
    """Prints lines immediately and collects them."""

    def __init__(self) -> None:
        self.whole = ""

    def say(self, line: str) -> None:
        self.whole += line + "\n"
        sys.stdout.write(line + "\n")
        sys.stdout.flush()

    def head(self, first: str, *others: str) -> None:
        self.say(f"{first[: len(first) - len(first.lstrip())]}| {' | '.join((first.strip(), *others))} |")
        self.say("|---" * (1 + len(others)) + "|")

    def line(self, *cells: str) -> None:
        self.say("| " + " | ".join(cells) + " |")


if __name__ == "__main__":
    sys.exit(main())
