"""The sites of the paper and of its authors' later work."""

from __future__ import annotations

from dataclasses import replace

from bimvox.env.actions import named
from bimvox.paper.env.spec import Box, PaperSpec, RandomObstructions, beam, column

PAPER = PaperSpec(
    shape=(15, 15, 6),
    construction_area=(5, 5, 10, 10),
    components=(column(4, (7, 7, 1)),),
    step_limit=15,
    max_steps=36,
)
"""The experiment: one column of four cells to the middle of 15 x 15 x 6. Only the paper's Figure 3 shows the areas, not
its text: here the construction area and the target are in the middle of the site."""

OBSTRUCTED = replace(PAPER, random_obstructions=RandomObstructions())
"""The same with one to three obstructions of the experiment's size, drawn anywhere for every episode."""

FOUR_COLUMNS_FOUR_BEAMS = PaperSpec(
    shape=(15, 15, 8),
    construction_area=(6, 6, 15, 15),
    components=(
        column(4, (9, 9, 1)),
        column(4, (9, 13, 1)),
        column(4, (13, 9, 1)),
        column(4, (13, 13, 1)),
        beam(3, (9, 10, 4), "y"),
        beam(3, (10, 9, 4), "x"),
        beam(3, (13, 10, 4), "y"),
        beam(3, (10, 13, 4), "x"),
    ),
)
"""The authors' later case: a frame of four columns with four beams between their heads, from random yards. Areas,
targets and lengths are those of their published environment."""

PRESETS: dict[str, PaperSpec] = {
    "paper": PAPER,
    "obstructed": OBSTRUCTED,
    "frame": FOUR_COLUMNS_FOUR_BEAMS,
}


def site_named(site: PaperSpec | str) -> PaperSpec:
    """Return a site, or the preset of that name."""
    return named("site", site, PRESETS) if isinstance(site, str) else site


def obstruction(x: int, y: int, axis: str, length_vox: int = 3, height_vox: int = 2) -> Box:
    """Return an obstruction on the slab from its lowest-index end; the default size is the experiments'."""
    dx, dy = (length_vox, 1) if axis == "x" else (1, length_vox)
    return (x, y, 1), (x + dx, y + dy, 1 + height_vox)
