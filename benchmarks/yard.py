"""Time saved by smaller truckloads: ``make bench-yard`` (ARGS=--write renews the table in docs/data/measured.txt).

A delivery arrives when its first part is next, so the yard is empty by then, and deliveries as large as the yard need
the fewest trucks. A smaller one (``[rules] truckload_kg``) takes the nearest places, and reuses them as soon as they
are empty. The sample is planned by complete search with several truckloads; hours are those of the timed motions, the
same on every machine.
"""

from __future__ import annotations

import dataclasses
import sys

from benchmarks.document import MEASURED, put_into
from benchmarks.motion import SAMPLES, site_of
from benchmarks.planning import crane_hours
from bimvox.planning.order_search import prepare
from bimvox.planning.planner import plan_lifts
from bimvox.site.site import Site

TRUCKLOADS_T = (0, 48, 24, 12)


def with_truckload(site: Site, truckload_t: float) -> Site:
    """Return a site whose deliveries have at most a mass; 0: as much as the yard holds."""
    return dataclasses.replace(site, rules=dataclasses.replace(site.rules, truckload_kg=1000.0 * truckload_t))


def rows(site: Site) -> list[str]:
    """Return the rows of the table."""
    found, first_h = [], 0.0
    for truckload_t in TRUCKLOADS_T:
        limited = with_truckload(site, truckload_t)
        preparation = prepare(limited)
        _, crane_h, moving_h = crane_hours(limited, preparation, plan_lifts(limited, preparation))
        first_h = first_h or moving_h
        deliveries = len({place.delivery for place in preparation.places if place is not None})
        found.append(
            f"| {truckload_t or 'what the yard holds'} | {deliveries} | {crane_h:.2f} / {moving_h:.2f} h "
            f"| {1.0 - moving_h / first_h:.0%} |"
        )
    return found


def main() -> None:
    """Print the table."""
    head = ["| truckload, t | deliveries | crane / moving | moving saved |", "|---:|---:|---|---:|"]
    text = "\n".join([*head, *rows(site_of(SAMPLES / "prefab.ifc"))])
    print(text)
    if "--write" in sys.argv:
        put_into(MEASURED, "bench-yard", text)


if __name__ == "__main__":
    main()
