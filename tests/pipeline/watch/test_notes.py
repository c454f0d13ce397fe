"""What a watch says about where obstructions are."""

from __future__ import annotations

import pytest
from bimvox_pipeline.watch.plan import notes_about
from box_buildings import rasterise_boxes
from box_sites import box_site

from bimvox.site.build import with_obstructions
from bimvox.site.obstructions.obstruction_set import Box, Obstruction, ObstructionSet

INSIDE = Obstruction("in", Box((5.0, 5.0, 0.0), (6.0, 6.0, 2.0)))
FAR = [Obstruction(f"far {n}", Box((900.0, 5.0, 0.0), (901.0, 6.0, 2.0))) for n in range(2)]


@pytest.mark.parametrize(
    ("given", "first"),
    [
        (FAR[:1], "serious: the only obstruction lies outside the site, which is from"),
        (FAR, "serious: all 2 obstructions lie outside the site, which is from"),
        ([*FAR, INSIDE], "obstruction 'far 0' lies outside the site"),
        ([INSIDE], None),
    ],
)
def test_a_file_of_which_nothing_is_inside_is_serious(given, first):
    site = box_site([("beam", (1.0, 1.0, 0.0), (4.0, 2.0, 1.0))], shape=(48, 24, 10))
    notes = notes_about(with_obstructions(site, ObstructionSet.of(given), rasterise_boxes))
    assert (not notes) if first is None else notes[0].startswith(first)
