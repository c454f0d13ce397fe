"""Time saved by the chosen sequence and yard, and the cost of the narrow phase: ``make bench-planning``.

Each model is planned by complete search: lowest first with the first free places in the yard, in the greedy order, and
as ``bimvox plan`` does it. Crane times are those of the timed motions, the same on every machine; shares are CPU time
of one thread. Other models can be named on the command line. A second table compares ways to search the order, by the
estimate, at the greedy order's places: each looks at as many parts as one round of the search. Site files of several
cranes get a third table instead. ``--write`` renews the tables in docs/data/measured.txt.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from benchmarks.document import MEASURED, put_into
from benchmarks.scale.building import write_site

SAMPLES = Path(__file__).parents[1] / "sample_models"
MODELS = ("frame.ifc", "prefab.ifc", "frame500")
_RESTARTS = 8
_NEVER_S = 1e6
_DRIVEN = ("approach", "raise", "hoist", "traverse", "lower")


class NarrowPhase:
    """Measures the CPU time of triangle tests during planning."""

    def __init__(self) -> None:
        from bimvox.planning import insertion
        from bimvox.planning.contact.pairs import Contacts
        from bimvox.planning.order import relations

        self.cpu_s = 0.0
        self._inside = False
        places: tuple[tuple[Any, str], ...] = (
            (Contacts, "meets_on_move"),
            (Contacts, "_find_clashes"),
            (relations, "rope_meets"),
            (insertion, "rope_meets"),
        )
        for owner, name in places:
            setattr(owner, name, self._counted(getattr(owner, name)))

    def _counted(self, function: Callable[..., Any]) -> Callable[..., Any]:
        def counted(*given: Any, **named: Any) -> Any:
            if self._inside:
                return function(*given, **named)
            self._inside, begun_s = True, time.process_time()
            try:
                return function(*given, **named)
            finally:
                self.cpu_s += time.process_time() - begun_s
                self._inside = False

        return counted


def row(name: str, site_file: Path, narrow: NarrowPhase) -> str:
    """Plan a site both ways and return its row of the table."""
    from bimvox.library.site import load_site
    from bimvox.planning.order.sequence import Sequencer
    from bimvox.planning.order_search import prepare
    from bimvox.planning.planner import plan_lifts
    from bimvox.planning.preparation import Preparation
    from bimvox.planning.yard import allocate_yard
    from bimvox.progress import SilentProgress

    site = load_site(site_file, SilentProgress()).site
    prepare(site)  # compiles or loads the kernels
    narrow.cpu_s, begun_s = 0.0, time.process_time()
    chosen = prepare(site)
    plan = plan_lifts(site, chosen)
    share = narrow.cpu_s / (time.process_time() - begun_s)
    order = Sequencer(site, chosen.relations, chosen.contacts).lowest_first()
    plain = Preparation(chosen.contacts, chosen.relations, order, allocate_yard(site, order.order))
    greedy = prepare(greedily(site))
    before, by_greed = (crane_hours(site, one, plan_lifts(site, one)) for one in (plain, greedy))
    after = crane_hours(site, chosen, plan)
    return (
        f"| {name} | {after[0]} of {len(site.components)} | {before[1]:.2f} / {before[2]:.2f} h "
        f"| {by_greed[1]:.3f} / {by_greed[2]:.3f} h | {after[1]:.3f} / {after[2]:.3f} h "
        f"| {1.0 - after[2] / before[2]:.1%} | {1.0 - after[2] / by_greed[2]:.1%} | {share:.0%} |"
    )


def greedily(site: Any) -> Any:
    """Return a site whose order is not searched."""
    return replace(site, rules=replace(site.rules, order_search=False))


def ways_row(name: str, site: Any) -> str:
    """Return the row of the second table: seconds saved by each way, and at most, of a site with one crane."""
    from bimvox.planning.order.faster_order import BUDGET, COOL_S, WARM_S, FasterOrder, searched, travel_of
    from bimvox.planning.order.makespan import makespan_s
    from bimvox.planning.order.sequence import Sequencer
    from bimvox.planning.order_search import prepare

    greedy = prepare(greedily(site))
    sequencer, order = Sequencer(site, greedy.relations, greedy.contacts), greedy.sequence.order
    search = FasterOrder(site, sequencer, greedy.relations, [travel_of(site, crane) for crane in site.cranes])
    times, fixed = search.problem(greedy.sequence, greedy.places)
    start_s, budget = makespan_s(times, order), BUDGET * len(order)

    def saved_s(first: tuple[int, ...], share: int, warm_s: float) -> float:
        return start_s - makespan_s(times, searched(times, first, fixed, budget // share, 0, warm_s)[0])

    random = np.random.default_rng(0)
    restarts = [saved_s(any_order(fixed, random), _RESTARTS, 0.0) for _ in range(_RESTARTS)]
    ways = (saved_s(order, 1, COOL_S), saved_s(order, 1, 0.0), max(restarts), saved_s(order, 1, WARM_S))
    own = [i for i in order if times.crane[i] >= 0]
    empty_s = sum(times.empty_s[0, a, b] for a, b in pairwise(own))
    most_s = empty_s - least_empty_s(times.empty_s[0][np.ix_(own, own)], fixed[np.ix_(own, own)])
    return f"| {name} | {' | '.join(f'{way:.0f}' for way in (*ways, most_s))} | {empty_s:.0f} |"


def cranes_row(site_file: Path) -> str:
    """Return the row of the third table: hours by the schedule of several cranes, and lifts refused in that time."""
    from bimvox.library.site import load_site
    from bimvox.planning.order_search import faster, prepare
    from bimvox.progress import SilentProgress
    from bimvox.site.means import Means

    site = load_site(site_file, SilentProgress()).site
    greedy, ids = prepare(site), [part.id for part in site.components]
    last = faster(site, greedy, free=ids)
    ways = [(site, greedy), faster(site, greedy), last]
    hours = " | ".join(map(schedule_hours, ways))
    moved = (
        0 if last is None else sum(a.crane != b.crane for a, b in zip(site.components, last[0].components, strict=True))
    )
    lifted = sum(part.means is Means.CRANE and greedy.places[part.index] is not None for part in site.components)
    return f"| {site_file.name.partition('.')[0]} | {lifted} | {hours} | {moved} |"


def schedule_hours(way: tuple[Any, Any] | None) -> str:
    """Return the hours of the schedule of several cranes, and the lifts refused in that time."""
    from bimvox.library.hand_over import waiting_and_end

    end = None if way is None else waiting_and_end(*way, free=[part.id for part in way[0].components])
    return "-" if end is None else f"{end[1] / 3.6e12:.2f} / {end[0]}"


def any_order(fixed: NDArray[np.bool_], random: np.random.Generator) -> tuple[int, ...]:
    """Return a random order that keeps the fixed pairs."""
    left, found = np.ones(len(fixed), np.bool_), []
    while left.any():
        found.append(int(random.choice(np.flatnonzero(left & ~fixed[left].any(axis=0)))))
        left[found[-1]] = False
    return tuple(found)


def least_empty_s(empty_s: NDArray[np.float64], fixed: NDArray[np.bool_]) -> float:
    """Return a lower bound of the empty moves of all orders that keep the fixed pairs: the best assignment.

    A part follows another one if it need not come before it, and no third one must come between both.
    """
    between = (fixed.astype(np.int64) @ fixed.astype(np.int64)) > 0
    cost = np.where(fixed.T | between | np.eye(len(fixed), dtype=np.bool_), _NEVER_S, empty_s)
    whole = np.zeros((len(fixed) + 1, len(fixed) + 1))  # before the first one, and after the last one
    whole[:-1, :-1], whole[-1, -1] = cost, _NEVER_S
    rows, columns = linear_sum_assignment(whole)
    return float(whole[rows, columns].sum())


def crane_hours(site: Any, preparation: Any, plan: Any) -> tuple[int, float, float]:
    """Return planned lifts, crane hours, and hours in which the crane moves."""
    from bimvox.motion.time_plan import time_plan

    return hours_of(time_plan(plan, preparation))


def hours_of(motions: Sequence[Any]) -> tuple[int, float, float]:
    """Return lifts, crane hours, and hours in which the crane moves."""
    driven_ns = sum(p.end_ns - p.start_ns for m in motions for p in m.phases if p.name.value in _DRIVEN)
    return len(motions), motions[-1].end_ns / 3.6e12, driven_ns / 3.6e12


def main() -> None:
    """Print the table."""
    from bimvox_pipeline.site import init

    from bimvox.library.site import load_site
    from bimvox.progress import SilentProgress

    given = [name for name in sys.argv[1:] if name != "--write"] or list(MODELS)
    if several := [Path(name) for name in given if name.endswith(".site.toml")]:
        head = ["| site | lifts | greedy, h / refused | searched | with other cranes | parts moved |"]
        _say("bench-planning-cranes", [*head, "|---|---:|---:|---:|---:|---:|", *map(cranes_row, several)])
        return
    narrow = NarrowPhase()
    lines = ["| model | lifts | plain: crane / moving | greedy | searched | moving saved | of greedy | narrow phase |"]
    lines += ["|---|---|---|---|---|---|---|---|"]
    ways = ["| model | search, s | descent | restarts | annealing | at most | empty hook |"]
    ways += ["|---|---:|---:|---:|---:|---:|---:|"]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for model in given:
            if model == "frame500":
                site_file = write_site(folder, 500)
            else:
                source = Path(model) if Path(model).exists() else SAMPLES / model
                site_file = folder / f"{source.stem}.site.toml"
                init(source, site_file, progress=SilentProgress())
            lines.append(row(Path(model).name, site_file, narrow))
            sys.stderr.write(f"{lines[-1]}\n")
            ways.append(ways_row(Path(model).name, load_site(site_file, SilentProgress()).site))
    _say("bench-planning", lines)
    _say("bench-planning-ways", ways)


def _say(name: str, lines: list[str]) -> None:
    print(*lines, sep="\n")
    if "--write" in sys.argv:
        put_into(MEASURED, name, "\n".join(lines))


if __name__ == "__main__":
    main()
