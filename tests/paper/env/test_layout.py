from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from paper_reference import cells_of, is_solvable

from bimvox.env.problem import default_problem
from bimvox.paper.env.layout import PaperLayout, random_layouts, yard_layouts
from bimvox.paper.env.site_env import PaperSiteEnv
from bimvox.paper.env.spec import (
    FOUR_COLUMNS_FOUR_BEAMS,
    OBSTRUCTED,
    PAPER,
    RandomObstructions,
    YardPose,
    beam,
    column,
    obstruction,
)

HERE = ((7, 7, 1),)


def test_every_start_of_the_yard_is_listed_once():
    layouts = yard_layouts(PAPER)
    starts = [(p.starts[0].x, p.starts[0].y, 2) for p in layouts]
    assert starts == sorted(tuple(s) for s in default_problem().starts_vox.tolist())
    with pytest.raises(ValueError, match="one component only"):
        yard_layouts(FOUR_COLUMNS_FOUR_BEAMS)


@pytest.mark.parametrize("every", [20, pytest.param(1, marks=pytest.mark.slow)])
def test_every_start_of_the_yard_can_be_solved(every: int):
    assert all(is_solvable(PAPER, layout) for layout in yard_layouts(PAPER)[::every])


def test_places_in_the_yard_are_drawn_evenly():
    small = replace(PAPER, shape=(7, 6, 6), construction_area=(2, 2, 7, 6), components=(column(4, (4, 4, 1)),))
    counts = Counter(layout.starts[0] for layout in random_layouts(small, 4000, seed=0))
    # Along x: 4 x 2 of the two rows; along y: 2 x 3 of the two columns.
    assert len(counts) == 14
    assert min(counts.values()) > 4000 / 14 * 0.75
    assert max(counts.values()) < 4000 / 14 * 1.25


@pytest.mark.parametrize(
    "spec",
    [
        OBSTRUCTED,
        replace(OBSTRUCTED, random_obstructions=RandomObstructions(8, 12, 3, 2), random_targets=True),
        replace(FOUR_COLUMNS_FOUR_BEAMS, random_obstructions=RandomObstructions(3, 3, 4, 3), random_targets=True),
    ],
)
def test_drawn_layouts_keep_the_rules(spec):
    layouts = random_layouts(spec, 60, seed=1)
    assert layouts == random_layouts(spec, 60, seed=1)
    assert layouts != random_layouts(spec, 60, seed=2)
    x0, y0, x1, y1 = spec.construction_area
    for layout in layouts:
        assert is_solvable(spec, layout)
        starts = [cells_of(p.box(c.length_vox)) for p, c in zip(layout.starts, spec.components, strict=True)]
        targets = [cells_of(c.box_at(t)) for t, c in zip(layout.targets, spec.components, strict=True)]
        things = [*starts, *targets, *(cells_of(box) for box in layout.obstructions)]
        assert sum(map(len, things)) == len(set().union(*things))
        assert all(spec.in_yard(x, y) and z == 1 for cells in starts for x, y, z in cells)
        assert all(x0 <= x < x1 and y0 <= y < y1 for cells in targets for x, y, _ in cells)
        assert len(layout.obstructions) <= spec.random_obstructions.most
        for (a, b, c), (d, e, f) in layout.obstructions:
            size = (spec.random_obstructions.length_vox, 1)
            assert (d - a, e - b) in (size, size[::-1])
            assert (c, f) == (1, 1 + spec.random_obstructions.height_vox)


def test_random_targets_reach_the_whole_area_and_a_frame_stays_a_frame():
    seen = {layout.targets[0][:2] for layout in random_layouts(replace(PAPER, random_targets=True), 500, seed=0)}
    assert seen == {(x, y) for x in range(5, 10) for y in range(5, 10)}
    frame = replace(FOUR_COLUMNS_FOUR_BEAMS, random_targets=True)
    designed = np.array([part.target_vox for part in frame.components])
    moves = set()
    for layout in random_layouts(frame, 200, seed=0):
        move = np.array(layout.targets) - designed
        assert (move == move[0]).all()
        moves.add(tuple(move[0].tolist()))
    assert moves == {(dx, dy, 0) for dx in range(-3, 2) for dy in range(-3, 2)}


def test_a_walled_target_has_no_path():
    walls = (obstruction(6, 6, "x"), obstruction(6, 8, "x"), obstruction(6, 7, "x", 1), obstruction(8, 7, "x", 1))
    layout = PaperLayout((YardPose(0, 0),), HERE, walls)
    assert not is_solvable(PAPER, layout)
    assert is_solvable(PAPER, replace(layout, obstructions=walls[1:]))


@pytest.mark.parametrize(
    ("layout", "message"),
    [
        (PaperLayout((), ()), "starts, targets: 0 and 0 for 1"),
        (PaperLayout((YardPose(3, 5, "x"),), HERE), r"starts\[0\].*not in the yard"),
        (PaperLayout((YardPose(12, 0, "x"),), HERE), r"starts\[0\].*inside"),
        (PaperLayout((YardPose(0, 0),), ((7, 7, 3),)), r"targets\[0\].*inside"),
        (PaperLayout((YardPose(0, 0),), HERE, (obstruction(2, 0, "x"),)), r"starts\[0\]: shares a cell"),
        (PaperLayout((YardPose(0, 0),), HERE, (((0, 0, 4), (1, 1, 5)),)), r"starts\[0\]: shares a cell"),
        (PaperLayout((YardPose(0, 0),), HERE, (obstruction(7, 6, "y"),)), r"targets\[0\]: shares a cell"),
    ],
)  # fmt: skip
def test_a_layout_that_does_not_fit_is_refused(layout, message):
    with pytest.raises(ValueError, match=message):
        PaperSiteEnv(PAPER).reset(options={"layout": layout})


def test_a_beam_is_stored_along_its_axis():
    spec = replace(PAPER, components=(beam(3, (6, 7, 1), "x"),))
    assert {layout.starts[0].axis for layout in random_layouts(spec, 50, seed=0)} == {"x"}
    with pytest.raises(ValueError, match="never turned"):
        PaperSiteEnv(spec).reset(options={"layout": PaperLayout((YardPose(0, 0, "y"),), ((6, 7, 1),))})
