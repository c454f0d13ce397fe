"""``python -m docs.sketches``: write every sketch into ``docs/images``."""

from __future__ import annotations

from pathlib import Path

from docs.sketches import cranes, files, loads, plan, room

SKETCHES = (
    room.clearances, room.gives_way, room.swing, room.zones,
    loads.slings, loads.turning_over, loads.tandem, loads.props,
    cranes.chart, cranes.two_cranes, cranes.set_ups,
    files.obstructions, files.days, files.exports, files.ground, files.sectors,
    plan.ways, plan.order, plan.two_clocks, plan.verified, plan.watching,
)  # fmt: skip
IMAGES = Path(__file__).parents[1] / "images"


def sketches() -> dict[str, str]:
    """Return every sketch as SVG by the name of its file."""
    return {f"sketch-{make.__name__.replace('_', '-')}.svg": make().svg() for make in SKETCHES}


if __name__ == "__main__":
    for name, svg in sketches().items():
        (IMAGES / name).write_text(svg, encoding="utf-8")
