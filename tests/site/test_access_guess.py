"""Lanes for lorries at each set-up of a crane that moves; those of one that stays are tested with ``init``."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import shapely
from bimvox_pipeline.studio.opened import Opened, open_site
from moving_sites import row_file

import bimvox
from bimvox.site.access_guess import proposed_access
from bimvox.site.checks import unloading_columns

YARDS = "[[[-1, -19], [10, -19], [10, -12], [-1, -12]], [[29, -19], [40, -19], [40, -12], [29, -12]]]"


def opened(folder: Path) -> Opened:
    """Return the row with a yard beside each set-up."""
    file = row_file(folder)
    text = file.read_text()
    start, end = text.index("yard = "), text.index("construction")
    file.write_text(f"{text[:start]}yard = {YARDS}\n{text[end:]}")
    return open_site(file)


def test_each_set_up_has_a_lane_from_which_it_unloads_its_parts(tmp_path: Path) -> None:
    site = opened(tmp_path)
    lanes = proposed_access(site.config, site.placed, site.lifted)
    assert lanes is not None and len(lanes) == 2
    for lane, place_m, yard in zip(lanes, ((4.5, -5.5), (34.5, -5.5)), site.config.areas.yard or (), strict=True):
        area = shapely.Polygon(lane)
        assert area.distance(shapely.Point(place_m)) < 14.0
        assert area.distance(shapely.Polygon(yard)) == 0.0 and not area.intersection(shapely.Polygon(yard)).area
    text = site.site.read_text()
    rows = ", ".join(str([list(corner) for corner in lane]) for lane in lanes)
    site.site.write_text(text.replace("[areas]\n", f"[areas]\naccess = [{rows}]\n"))
    made = bimvox.plan(bimvox.load_site(site.site), policy="none", jobs=1)
    assert made.verdict is not None and made.verdict.verified
    assert len(made.motions) == 6
    for number, lane in enumerate(lanes):  # each crane picks from its own lane, not from the other
        component = next(one for one in made.site.components if one.crane == number)
        x = made.site.frame.corner_of(np.append(unloading_columns(made.site, component)[0], 0))[0]
        assert abs(x - shapely.Polygon(lane).centroid.x) < 12.0
    assert proposed_access(site.config.model_copy(update={"crane": None}), site.placed, site.lifted) is None


def test_a_part_goes_to_a_set_up_that_unloads_it(tmp_path: Path) -> None:
    """Both set-ups reach the middle panel, but only the farther one a lorry."""
    file = row_file(
        tmp_path, panels=(15.0,), places={"near": (16.5, -5.5), "far": (6.0, -5.5)},
        more="",
    )  # fmt: skip
    lane = "[[-14, -10], [-10, -10], [-10, 7], [-14, 7]]"
    assert [one.crane for one in bimvox.plan(bimvox.load_site(file), policy="none", jobs=1).motions] == [0]
    file.write_text(file.read_text().replace("[areas]\n", f"[areas]\naccess = [{lane}]\n"))
    site = bimvox.load_site(file).site
    part = site.components[0]
    assert [len(unloading_columns(site, replace(part, crane=number))) > 0 for number in (0, 1)] == [False, True]
    made = bimvox.plan(bimvox.load_site(file), policy="none", jobs=1)
    assert [one.crane for one in made.motions] == [1]
