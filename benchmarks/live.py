"""``python -m benchmarks.live``: seconds lost a lift in simulated traffic, by who decides.

``make bench-live``: the tables in docs/live.md. Rules are tuned on other seeds than those of the tables.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path

os.environ.setdefault("NUMBA_NUM_THREADS", "1")

import numpy as np
from numpy.typing import NDArray

from benchmarks.document import put_into
from benchmarks.live_deciders import MonteCarlo, Oracle
from bimvox.live.deciders import Decider, Rules, stop_and_wait
from bimvox.live.episode import Episode, LiveJob, Stage
from bimvox.live.traffic import DENSITIES, Habits

SAMPLES = Path(__file__).parents[1] / "sample_models"
SITES = ("prefab.ifc", "hall.ifc")
LIFTS, EPISODES, TUNED_ON = 10, 200, 40
TUNING_SEED, HELD_OUT_SEED = 1_000_000, 2_000_000
TWO_WAYS = ", two ways a lift"
WRONG = Habits(walk_low_m_s=0.4, walk_high_m_s=0.8, dwell_s=360.0, at_home=0.95, unload_s=140.0)


@dataclass(frozen=True, slots=True, eq=False)
class Outcome:
    """Of one decider in one setting, an entry an episode."""

    lost_s: NDArray[np.float64]
    held_s: float
    violations: int
    cut: int
    decision_ms: float


def outcome(job: LiveJob, traffic: str, decide: Decider, seeds: Iterable[int]) -> Outcome:
    """Run episodes, one a seed of the traffic."""
    lost, held, violations, cut, decisions, spent_s = [], 0.0, 0, 0, 0, 0.0
    for seed in seeds:
        episode = Episode(job, DENSITIES[traffic], seed)
        while episode.stage is not Stage.OVER:
            started_s = time.process_time()
            choice = decide(episode)
            spent_s += time.process_time() - started_s
            decisions += 1
            episode.decide(choice)
        lost.append(episode.lost_s)
        held, violations, cut = held + episode.held_s, violations + episode.violations, cut + episode.is_cut
    return Outcome(np.array(lost), held / len(lost) / len(job.lifts), violations, cut, 1e3 * spent_s / decisions)


def tuned(job: LiveJob) -> dict[str, Decider]:
    """Return all deciders; the rules with the values that lose least in medium traffic."""

    def best(candidates: Iterable[Rules | MonteCarlo]) -> Rules | MonteCarlo:
        seeds = range(TUNING_SEED, TUNING_SEED + TUNED_ON)
        return min(candidates, key=lambda one: outcome(job, "medium", one, seeds).lost_s.mean())

    waits = tuple(product((10.0, 30.0), (3, 12)))
    planned = best(Rules(False, near, 4.0, 0.0, blocked, n) for near in (4.0, 7.0) for blocked, n in waits)
    chosen = best(
        Rules(True, near, weight, 0.0, blocked, n)
        for near, weight in product((4.0, 7.0), (2.0, 6.0))
        for blocked, n in waits
    )
    assert isinstance(chosen, Rules)
    moving = best(replace(chosen, horizon_s=horizon, waits=n) for horizon in (10.0, 30.0) for n in (3, 12))
    rolled = best(MonteCarlo(8, Habits(), near, weight, 3) for near, weight in product((4.0, 7.0), (2.0, 6.0)))
    for one in (planned, chosen, moving, rolled):
        sys.stdout.write(f"tuned: {one}\n")
    assert isinstance(rolled, MonteCarlo)
    return {
        "stops and waits": stop_and_wait,
        "plan's order, waits on the snapshot (tuned)": planned,
        "also chooses the next lift (tuned)": chosen,
        f"the same{TWO_WAYS}": chosen,
        "constant-velocity prediction (tuned)": moving,
        "Monte Carlo, traffic model known (tuned)": rolled,
        "Monte Carlo, wrong model": replace(rolled, habits=WRONG),
        "oracle that knows the future, greedy": Oracle(),
        f"the same oracle{TWO_WAYS}": Oracle(),
    }


def jobs_from(model: Path) -> dict[int, LiveJob]:
    """Plan a sample as a stranger would, and return its first lifts with one way each, and with up to two."""
    import bimvox

    plan = bimvox.plan(bimvox.guess_site(bimvox.read(model)), policy="none")
    return {ways: bimvox.live_job(plan, count=LIFTS, ways=ways) for ways in (1, 2)}


Settings = Mapping[tuple[str, str], Mapping[str, Outcome]]
"""Outcomes of the deciders, by site and traffic."""


def table(found: Settings) -> str:
    """Return the table: a row a decider, a column a setting, and what holds for all of them."""
    heads = [f"{site.partition('.')[0]}, {traffic}" for site, traffic in found]
    lines = [
        "| decides | " + " | ".join(heads) + " | a decision, ms |",
        "|---|" + "---|" * (len(heads) + 1),
    ]
    for who in next(iter(found.values())):
        ones = [setting[who] for setting in found.values()]
        usual = [setting["stops and waits"].lost_s for setting in found.values()]
        cells = [
            _interval(one.lost_s) + ("" if one.lost_s is lost else f" ({_interval(lost - one.lost_s)})")
            for one, lost in zip(ones, usual, strict=True)
        ]
        slowest = max(one.decision_ms for one in ones)
        lines.append(f"| {who} | " + " | ".join(cells) + f" | {slowest:.2g} |")
    every = [one for setting in found.values() for one in setting.values()]
    lifts = LIFTS * sum(len(one.lost_s) for one in every)
    lines += [
        "",
        f"Under a suspended load, in {lifts:,} lifts: {sum(one.violations for one in every)} ticks. "
        f"Others wait at closed zones for {min(one.held_s for one in every):.0f} to "
        f"{max(one.held_s for one in every):.0f} s a lift. "
        f"Episodes cut: {sum(one.cut for one in every)} of {sum(len(one.lost_s) for one in every):,}.",
    ]
    return "\n".join(lines)


def _interval(values: NDArray[np.float64]) -> str:
    return f"{values.mean():.0f}±{1.96 * values.std(ddof=1) / np.sqrt(len(values)):.0f}"


def main() -> None:
    """Print the table of each setting, then the whole."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="write the table into docs/live.md")
    parser.add_argument("--episodes", type=int, default=EPISODES, help="held-out episodes a setting")
    chosen = parser.parse_args()
    jobs = {name: jobs_from(SAMPLES / name) for name in SITES}
    deciders = tuned(jobs[SITES[0]][1])
    seeds = range(HELD_OUT_SEED, HELD_OUT_SEED + chosen.episodes)
    found: dict[tuple[str, str], dict[str, Outcome]] = {}
    for (name, by_ways), traffic in product(jobs.items(), DENSITIES):
        found[name, traffic] = {
            who: outcome(by_ways[1 + who.endswith(TWO_WAYS)], traffic, decide, seeds)
            for who, decide in deciders.items()
        }
        sys.stdout.write(f"{table({(name, traffic): found[name, traffic]})}\n")
        sys.stdout.flush()
    second = ", ".join(
        f"{sum(len(lift.ways) > 1 for lift in job[2].lifts)} of {len(job[2].lifts)} lifts of {name.partition('.')[0]}"
        for name, job in jobs.items()
    )
    text = f"{table(found)} A second way has been proven for {second}."
    sys.stdout.write(text + "\n")
    if chosen.write:
        put_into(Path("docs/live.md"), "bench-live", text)


if __name__ == "__main__":
    main()
