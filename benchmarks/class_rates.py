"""Crane time of a part by its class of work, next to published rates: ``make bench-class-rates``, docs/work.md.

Samples are planned as ``bimvox init`` sets them up: default times, motion included, without unloading, breaks and wind.
No sample is of steel: those rows are hall.ifc with every part taken as steel, masses as they are.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from benchmarks.motion import SAMPLES, site_of
from bimvox.motion.time_plan import time_plan
from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.site.site import Site
from bimvox.site.work import work_of

SHIFT_MIN = 480.0


def rows(name: str, site: Site) -> Iterator[str]:
    """Yield a row of the table for each class of work of a site."""
    preparation = prepare(site)
    minutes: dict[str, list[float]] = {}
    for motion in time_plan(plan_lifts(site, preparation), preparation):
        work = work_of(site.components[motion.component]).value
        minutes.setdefault(work, []).append((motion.end_ns - motion.start_ns) / 6e10)
    for work, own in sorted(minutes.items()):
        each = sum(own) / len(own)
        yield f"| {work} | {name} | {len(own)} | {each:.1f} | {int(SHIFT_MIN / each)} |"


def in_steel(site: Site) -> Site:
    """Return a site whose parts are of steel; gear and crane are the same."""
    return replace(site, components=tuple(replace(part, material="steel") for part in site.components))


def main() -> None:
    """Print the table."""
    hall = site_of(SAMPLES / "hall.ifc")
    sites = {"prefab.ifc": site_of(SAMPLES / "prefab.ifc"), "hall.ifc": hall, "hall.ifc in steel": in_steel(hall)}
    print("| class | model | parts | minutes a part | in 8 h |", "|---|---|---:|---:|---:|", sep="\n")
    for name, site in sites.items():
        print(*rows(name, site), sep="\n")


if __name__ == "__main__":
    main()
