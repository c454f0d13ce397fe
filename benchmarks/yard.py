"""Time saved by smaller truckloads: ``make bench-yard``.

A delivery arrives when its first part is next, so the yard is empty by then, and deliveries as large as the yard need
the fewest trucks. A smaller one (``[rules] truckload_kg``) takes the nearest places, and reuses them as soon as they
are empty. Each model is planned by complete search with several truckloads; hours are those of the timed motions, the
same on every machine.
"""

from __future__ import annotations

import dataclasses
import tempfile
from pathlib import Path

from benchmarks.planning import crane_hours
from benchmarks.scale.building import write_site

SAMPLES = Path(__file__).parents[1] / "sample_models"
TRUCKLOADS_T = (0, 48, 24, 12)


def main() -> None:
    """Print the table."""
    from bimvox_pipeline.site import init

    from bimvox.progress import SilentProgress

    print("| model | truckload, t | deliveries | lifts | crane / moving | moving saved |")
    print("|---|---:|---:|---|---|---:|")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        site_file = folder / "prefab.site.toml"
        init(SAMPLES / "prefab.ifc", site_file, progress=SilentProgress())
        rows("prefab.ifc", site_file)
        rows("500 components (`benchmarks/scale`)", write_site(folder, 500))


def rows(name: str, site_file: Path) -> None:
    """Print the rows of one model."""
    from bimvox.library.site import load_site
    from bimvox.planning.planner import plan_lifts
    from bimvox.planning.preparation import prepare
    from bimvox.progress import SilentProgress

    site = load_site(site_file, SilentProgress()).site
    first_h = 0.0
    for truckload_t in TRUCKLOADS_T:
        rules = dataclasses.replace(site.rules, truckload_kg=1000.0 * truckload_t)
        limited = dataclasses.replace(site, rules=rules)
        preparation = prepare(limited)
        lifts, crane_h, moving_h = crane_hours(limited, preparation, plan_lifts(limited, preparation))
        first_h = first_h or moving_h
        deliveries = len({place.delivery for place in preparation.places if place is not None})
        print(
            f"| {name} | {truckload_t or 'what the yard holds'} | {deliveries} | {lifts} of {len(site.components)} "
            f"| {crane_h:.2f} / {moving_h:.2f} h | {1.0 - moving_h / first_h:.0%} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
