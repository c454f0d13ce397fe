"""What ``bimvox optimise`` finds, against the given set-up, the classical estimate, a grid, and random set-ups.

``python -m benchmarks.optimise MODEL... [--places N] [--grid N] [--yards N] [--write]``: each model gets the site file
of ``bimvox init``. ``--write`` renews the rows of these models in the table.
A machine that serves all parts that any machine serves is drawn N times, each with one of its places, and planned in
full. The table says how well the estimate ranks these plans (Spearman), and how many hours the crane moves with the
given set-up, with the best that ``optimise`` plans, the given one included, with the best of as many that the
classical estimate chooses among the same machines and places (one cycle time: straight lines between the middle of
the yard and each part's place, at the mean speed of the hook), with the best of those drawn, and with the best of a
grid of places of the fastest machine (brute force). The bound is the least that any hammerhead can move from any
place looked at with its yard, whatever the order and the places in the yard. Cost: the cheapest that ``optimise``
plans, against the given, and what standing costs with the cheapest machine that carries as many parts.
"""

from __future__ import annotations

import argparse
import shutil
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from bimvox_pipeline.fleet.command import fleet
from bimvox_pipeline.fleet.runs import FAILED, Wish, runs_of
from bimvox_pipeline.optimise import optimise
from bimvox_pipeline.site import init
from bimvox_pipeline.studio.opened import Opened, open_site
from bimvox_pipeline.studio.saving import save_variant
from bimvox_pipeline.studio.setup import CraneSetup

from bimvox.library.set_up_search.choose import search_set_ups
from bimvox.library.set_up_search.search import Search
from bimvox.library.set_up_search.set_up import Effort, Tried, front_of
from bimvox.progress import SilentProgress
from bimvox.site.catalogue import catalogue
from bimvox.site.config.calendar import Rates

_TABLE = Path(__file__).parents[1] / "docs" / "data" / "optimise.txt"
_HEAD = (
    "model", "parts", "standing_h", "given", "optimise", "classical", "drawn", "grid", "bound", "less", "cost",
    "cheapest", "least_cost", "spearman", "n",
)  # fmt: skip
_FOOT = "given, optimise, classical, drawn, grid: hours in which the crane moves, and (infeasible lifts)"


@dataclass(frozen=True)
class Planned:
    """A set-up and its plan.

    Attributes:
        infeasible: Lifts that are infeasible.
        hours: Crane hours.
        cost: By the rates of the site file.
    """

    infeasible: int
    hours: float
    cost: float


_NO_PLAN = Planned(10**6, 10.0**6, 10.0**9)


def main() -> None:
    """Print the table, and write it if asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("models", nargs="+", type=Path)
    parser.add_argument("--places", type=int, default=20)
    parser.add_argument("--grid", type=int, default=12)
    parser.add_argument("--yards", type=int, default=48)
    parser.add_argument("--write", action="store_true")
    given = parser.parse_args()
    head, rows = "  ".join(f"{word:>10}" for word in _HEAD), {}
    print(head, flush=True)
    for model in given.models:
        cells = _row(model, given)
        rows[cells[0]] = "  ".join(f"{cell:>10}" for cell in cells)
        print(rows[cells[0]], flush=True)
    if given.write:
        written = _TABLE.read_text().splitlines() if _TABLE.exists() else []
        end = next((n for n, line in enumerate(written) if line.startswith("given,")), len(written))
        kept = {line.split()[0]: line for line in written[1:end]}
        _TABLE.write_text("\n".join([head, *(kept | rows).values(), *(written[end:] or [_FOOT])]) + "\n")


def _row(model: Path, wanted: argparse.Namespace) -> list[str]:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        shutil.copy(model, folder)
        site = folder / "given.site.toml"
        init(folder / model.name, out=site, progress=SilentProgress())
        effort = Effort(yards=wanted.yards, cranes=1)
        document = optimise(site, folder / "ours", effort=effort, progress=SilentProgress())
        own = [_ours(one) for one in (*document["front"], *document["losers"])]
        opened, given = open_site(site), _ours(document["baseline"])
        # The journal of the yards is there: nothing is tried again.
        searched = search_set_ups(opened, model.stem, catalogue(), effort, folder / "ours", SilentProgress())
        search = searched.search
        found = [one for one in searched.lattice if one.crane is not None]
        best = front_of(found)[0]
        able = [one for one in found if one.served == best.served and not one.is_least_used]
        rng = np.random.default_rng(0)
        drawn = [
            (one, _any_place(one, rng)) for one in (able[int(rng.integers(len(able)))] for _ in range(wanted.places))
        ]
        theirs = _classical(search, able)[: len(own)]
        places = np.flatnonzero(best.all_served == best.served)
        grid = [(best, int(at)) for at in places[:: max(1, -(-len(places) // wanted.grid))]] if wanted.grid else []
        groups = [theirs, drawn, grid]
        files = [[_file(opened, f"{g}-{n}", *one) for n, one in enumerate(group)] for g, group in enumerate(groups)]
        wishes = [Wish(path) for group in files for path in group]
        runs = fleet(wishes, folder / "runs", progress=SilentProgress())["runs"]
        by_site = {run.wish.site: record for run, record in zip(runs_of(wishes), runs, strict=True)}
        rates = {machine.name: search.rates(machine) for machine in catalogue()}
        others = [
            [_planned(by_site[path.resolve()], rates[one.machine]) for path, (one, _) in zip(paths, group, strict=True)]
            for paths, group in zip(files, groups, strict=True)
        ]
        standing_h, random = document["standing_hours"], others[1]
        like = [n for n, plan in enumerate(random) if plan.infeasible == given.infeasible]
        estimates = [search.from_place(one, one.bases_m[at]).crane_s for one, at in drawn]
        rank = _spearman([estimates[n] for n in like], [random[n].hours for n in like])
        # Where nothing that it plans is better than the given set-up, that is its result.
        own.append(given)
        moving = [given, *(_best(some) if some else None for some in (own, *others))]
        cheapest = min((plan for plan in own if plan.infeasible <= given.infeasible), key=lambda plan: plan.cost)
        less = 1.0 - (_best(own).hours - standing_h) / (given.hours - standing_h)
        return [
            model.stem[:10],
            str(document["parts"]),
            f"{standing_h:.2f}",
            *("-" if plan is None else _moving(plan, standing_h) for plan in moving),
            f"{document['least_moving_hours']:.2f}",
            f"{less:.0%}",
            f"{given.cost:.0f}",
            f"{cheapest.cost:.0f}",
            f"{document['least_cost']:.0f}",
            f"{rank:.2f}",
            str(len(like)),
        ]


def _ours(one: dict[str, Any]) -> Planned:
    """Return a set-up as ``optimise`` planned it."""
    if one["hours"] is None:
        return _NO_PLAN
    return Planned(one["refused"], one["hours"], one["cost"])


def _planned(record: dict[str, Any], rates: Rates) -> Planned:
    if record["status"] == FAILED:
        return _NO_PLAN
    hours = record["figures"]["crane_hours"]
    return Planned(record["infeasible"], hours, rates.total(hours, record["figures"]["hire_days"]))


def _any_place(one: Tried, rng: np.random.Generator) -> int:
    places = np.flatnonzero(one.all_served == one.served)
    return int(places[rng.integers(len(places))])


def _moving(plan: Planned, standing_h: float) -> str:
    """Return the hours in which the crane moves, which are known if it stands for every part, and infeasible lifts."""
    return f"{'-' if plan.infeasible else f'{plan.hours - standing_h:.2f}'} ({plan.infeasible})"


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


def _file(opened: Opened, name: str, one: Tried, at: int) -> Path:
    (own,) = opened.setup.cranes
    x, y = one.bases_m[at].tolist()
    crane = CraneSetup(name=own.name, machine=one.machine, base_m=(x, y), jib_m=one.jib_m, falls=one.falls)
    path = opened.site.with_name(f"set-up-{name}.site.toml")
    yard = {} if one.yard is None else {"yard": (one.yard.polygon,), "truckload_kg": one.yard.truckload_kg}
    made = save_variant(opened, opened.setup.model_copy(update={"cranes": (crane,), **yard}), path)
    return made if isinstance(made, Path) else path


def _spearman(first: Sequence[float], second: Sequence[float]) -> float:
    from scipy.stats import spearmanr

    return float(spearmanr(first, second).statistic)


if __name__ == "__main__":
    main()
