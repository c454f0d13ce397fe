"""What ``bimvox optimise`` finds, against the given set-up, the classical estimate, and set-ups drawn at random.

``python -m benchmarks.optimise MODEL... [--places N] [--write]``: each model gets the site file of ``bimvox init``. A
machine that serves all parts that any machine serves is drawn N times, each with one of its places, and planned in
full. The table says how well the estimate ranks these plans (Spearman), and how many hours the crane moves with the
given set-up, with the best that ``optimise`` plans, with the best of as many that the classical estimate chooses among
the same machines and places (one cycle time: straight lines between the middle of the yard and each part's place, at
the mean speed of the hook), and with the best of those drawn.
"""

from __future__ import annotations

import argparse
import shutil
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from bimvox_pipeline.fleet.command import fleet
from bimvox_pipeline.fleet.runs import Wish, runs_of
from bimvox_pipeline.optimise.front import front_of, to_plan
from bimvox_pipeline.optimise.optimise import MEMBERS
from bimvox_pipeline.optimise.search import Search, Tried
from bimvox_pipeline.site import init
from bimvox_pipeline.studio.opened import Opened, open_site
from bimvox_pipeline.studio.saving import save
from bimvox_pipeline.studio.setup import CraneSetup

from bimvox.progress import SilentProgress
from bimvox.site.catalogue import catalogue

_TABLE = Path(__file__).parents[1] / "docs" / "data" / "optimise.txt"
_HEAD = ("model", "parts", "standing_h", "given", "optimise", "classical", "drawn", "less", "spearman", "n")


@dataclass(frozen=True)
class Planned:
    """A set-up and its plan.

    Attributes:
        infeasible: Lifts that are infeasible.
        hours: Crane hours.
    """

    infeasible: int
    hours: float


def main() -> None:
    """Print the table, and write it if asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("models", nargs="+", type=Path)
    parser.add_argument("--places", type=int, default=20)
    parser.add_argument("--write", action="store_true")
    given = parser.parse_args()
    lines = ["  ".join(f"{word:>10}" for word in _HEAD)]
    print(lines[0], flush=True)
    for model in given.models:
        lines.append("  ".join(f"{word:>10}" for word in _row(model, given.places)))
        print(lines[-1], flush=True)
    lines.append("given, optimise, classical, drawn: hours in which the crane moves, and (infeasible lifts)")
    print(lines[-1])
    if given.write:
        _TABLE.write_text("\n".join(lines) + "\n")


def _row(model: Path, places: int) -> list[str]:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        shutil.copy(model, folder)
        site = folder / "given.site.toml"
        init(folder / model.name, out=site, progress=SilentProgress())
        opened = open_site(site)
        search = Search(opened, SilentProgress())
        found = [one for one in search.tried(catalogue()) if one.crane is not None]
        best = front_of(found)[0]
        able = [one for one in found if one.served == best.served]
        rng = np.random.default_rng(0)
        drawn = [(one, _any_place(one, rng)) for one in (able[int(rng.integers(len(able)))] for _ in range(places))]
        ours = [(one, _place(one)) for one in to_plan(found, front_of(found), MEMBERS)]
        theirs = _classical(search, able)[: len(ours)]
        chosen = [*ours, *theirs, *drawn]
        files = [_file(opened, n, *one) for n, one in enumerate(chosen)]
        wishes = [Wish(path) for path in (site, *files)]
        runs = fleet(wishes, folder / "runs", progress=SilentProgress())["runs"]
        by_site = {
            run.wish.site: Planned(record["infeasible"], record["figures"]["crane_hours"])
            for run, record in zip(runs_of(wishes), runs, strict=True)
        }
        plans = [by_site[path.resolve()] for path in (site, *files)]
        standing_h = float(search.work.standing_s.sum()) / 3600.0
        estimates = [one.all_crane_s[at] for one, at in drawn]
        by_us, by_them, random = plans[1 : 1 + len(ours)], plans[1 + len(ours) : -places], plans[-places:]
        like = [n for n, plan in enumerate(random) if plan.infeasible == plans[0].infeasible]
        rank = _spearman([estimates[n] for n in like], [random[n].hours for n in like])
        moving = [plans[0], *(_best(some) for some in (by_us, by_them, random))]
        less = 1.0 - (moving[1].hours - standing_h) / (moving[0].hours - standing_h)
        return [
            model.stem[:10],
            str(len(search.work.places_m)),
            f"{standing_h:.2f}",
            *(f"{plan.hours - standing_h:.2f} ({plan.infeasible})" for plan in moving),
            f"{less:.0%}",
            f"{rank:.2f}",
            str(len(like)),
        ]


def _any_place(one: Tried, rng: np.random.Generator) -> int:
    places = np.flatnonzero(one.all_served == one.served)
    return int(places[rng.integers(len(places))])


def _place(one: Tried) -> int:
    """Return the index of the best place of a machine."""
    assert one.crane is not None
    return int(np.argmin(np.hypot(*(one.bases_m - np.array(one.crane.base_m[:2])).T)))


def _best(plans: Sequence[Planned]) -> Planned:
    return min(plans, key=lambda plan: (plan.infeasible, plan.hours))


def _classical(search: Search, able: Sequence[Tried]) -> list[tuple[Tried, int]]:
    """Return machines, each with its best place, by the sum of cycle times, each from one mean speed of the hook."""
    middle = search.work.yard_m.mean(axis=0)
    way_m = 2.0 * float(np.hypot(*(search.work.places_m - middle).T).mean())
    found: dict[str, tuple[float, Tried, int]] = {}
    for one in able:
        assert one.crane is not None
        for at in np.flatnonzero(one.all_served == one.served).tolist():
            base = one.bases_m[at]
            radius_m = float(np.hypot(*(search.work.places_m - base).T).mean()) + float(np.hypot(*(middle - base)))
            cycle_s = way_m / (0.5 * (one.crane.trolley.rate + one.crane.slewing.rate * 0.5 * radius_m))
            if one.machine not in found or cycle_s < found[one.machine][0]:
                found[one.machine] = (cycle_s, one, at)
    return [(one, at) for _, one, at in sorted(found.values(), key=lambda each: each[0])]


def _file(opened: Opened, number: int, one: Tried, at: int) -> Path:
    (own,) = opened.setup.cranes
    x, y = one.bases_m[at].tolist()
    crane = CraneSetup(name=own.name, machine=one.machine, base_m=(x, y), jib_m=one.jib_m, falls=one.falls)
    path = opened.site.with_name(f"set-up-{number}.site.toml")
    save(opened, opened.setup.model_copy(update={"cranes": (crane,)}), path)
    return path


def _spearman(first: Sequence[float], second: Sequence[float]) -> float:
    from scipy.stats import spearmanr

    return float(spearmanr(first, second).statistic)


if __name__ == "__main__":
    main()
