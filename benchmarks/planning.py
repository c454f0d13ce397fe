"""Time saved by the chosen sequence and yard, and the cost of the narrow phase: ``make bench-planning``.

Each model is planned twice by complete search: lowest first with the first free places in the yard, and as ``bimvox
plan`` does it. Crane times are those of the timed motions, the same on every machine; shares are CPU time of one
thread. Other models can be named on the command line.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from benchmarks.scale.building import write_site

SAMPLES = Path(__file__).parents[1] / "sample_models"
MODELS = ("frame.ifc", "prefab.ifc", "frame500")
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
    from bimvox.planning.assembly import Preparation, prepare
    from bimvox.planning.order.sequence import Sequencer
    from bimvox.planning.planner import plan_lifts
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
    before, after = crane_hours(site, plain, plan_lifts(site, plain)), crane_hours(site, chosen, plan)
    return (
        f"| {name} | {after[0]} of {len(site.components)} | {before[1]:.2f} / {before[2]:.2f} h "
        f"| {after[1]:.2f} / {after[2]:.2f} h | {1.0 - after[2] / before[2]:.0%} | {share:.0%} |"
    )


def crane_hours(site: Any, preparation: Any, plan: Any) -> tuple[int, float, float]:
    """Return planned lifts, crane hours, and hours in which the crane moves."""
    from bimvox.motion.time_plan import time_plan

    motions = time_plan(plan, preparation)
    driven_ns = sum(p.end_ns - p.start_ns for m in motions for p in m.phases if p.name.value in _DRIVEN)
    return len(motions), motions[-1].end_ns / 3.6e12, driven_ns / 3.6e12


def main() -> None:
    """Print the table."""
    from bimvox_pipeline.site import init

    from bimvox.progress import SilentProgress

    narrow = NarrowPhase()
    print("| model | lifts | plain: crane / moving | chosen: crane / moving | moving saved | narrow phase |")
    print("|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for model in sys.argv[1:] or MODELS:
            if model == "frame500":
                site_file = write_site(folder, 500)
            else:
                source = Path(model) if Path(model).exists() else SAMPLES / model
                site_file = folder / f"{source.stem}.site.toml"
                init(source, site_file, progress=SilentProgress())
            print(row(Path(model).name, site_file, narrow), flush=True)


if __name__ == "__main__":
    main()
