from __future__ import annotations

from dataclasses import replace

import pytest

from bimvox.paper.env.spec import (
    FOUR_COLUMNS_FOUR_BEAMS,
    OBSTRUCTED,
    PAPER,
    PRESETS,
    PaperComponent,
    PaperSpec,
    RandomObstructions,
    YardPose,
    beam,
    column,
    obstruction,
)

NARROW = {"shape": (8, 8, 6), "construction_area": (1, 1, 8, 8), "obstructions": (((3, 0, 1), (4, 1, 2)),)}
"""A yard one cell wide, cut by an obstruction."""

FLAT, CROSS = YardPose(0, 0, "x"), YardPose(2, 0, "y")


def test_the_papers_experiment():
    assert PAPER.shape == (15, 15, 6)
    assert [(p.kind, p.length_vox, p.target_vox) for p in PAPER.components] == [("column", 4, (7, 7, 1))]
    assert (PAPER.steps_before_late, PAPER.steps_allowed) == (15, 36)
    assert PAPER.in_yard(4, 7)
    assert not PAPER.in_yard(5, 5)
    assert not PAPER.in_yard(9, 9)
    assert PAPER.in_yard(10, 9)
    assert not PAPER.in_yard(15, 0)
    assert obstruction(3, 4, "y") == ((3, 4, 1), (4, 7, 3))
    assert replace(OBSTRUCTED, random_obstructions=None) == PAPER
    assert set(PRESETS) == {"paper", "obstructed", "frame"}


def test_limits_follow_from_the_size_where_none_are_given():
    free = replace(FOUR_COLUMNS_FOUR_BEAMS, step_limit=None, max_steps=None)
    assert (free.steps_before_late, free.steps_allowed) == (38, 8 * 38)


def test_a_beam_waits_for_the_columns_that_carry_it():
    frame = FOUR_COLUMNS_FOUR_BEAMS
    assert [frame.waits_for(serial) for serial in range(1, 9)] == [(), (), (), (), (1, 2), (1, 3), (3, 4), (2, 4)]
    on_top = replace(frame, components=(column(3, (9, 9, 1)), column(3, (9, 13, 1)), beam(5, (9, 9, 4), "y")))
    assert on_top.waits_for(3) == (1, 2)
    alone = replace(on_top, components=(*on_top.components[:2], beam(5, (9, 9, 4), "y", after=())))
    assert alone.waits_for(3) == ()


def test_components_that_still_wait_are_skipped():
    parts = FOUR_COLUMNS_FOUR_BEAMS.components
    shuffled = replace(
        FOUR_COLUMNS_FOUR_BEAMS, components=(parts[4], parts[1], parts[5], parts[0], *parts[6:], *parts[2:4])
    )
    assert shuffled.building_order() == (2, 4, 1, 7, 3, 8, 5, 6)
    ordered = shuffled.in_building_order()
    assert ordered.building_order() == tuple(range(1, 9))
    assert [p.target_vox for p in ordered.components] == [
        shuffled.components[i - 1].target_vox for i in shuffled.building_order()
    ]
    assert ordered.waits_for(3) == (1, 2)
    assert ordered.in_building_order() == ordered


@pytest.mark.parametrize(
    ("field", "changes"),
    [
        ("shape", {"shape": (15, 15)}),
        ("shape", {"shape": (15, 15, 2)}),
        ("construction_area", {"construction_area": (5, 5, 5, 10)}),
        ("construction_area", {"construction_area": (5, 5, 16, 10)}),
        ("construction_area", {"construction_area": (0, 0, 15, 15)}),
        ("components", {"components": ()}),
        ("components[0].length_vox", {"components": (column(0, (7, 7, 1)),)}),
        ("components[0].length_vox", {"components": (column(5, (7, 7, 1)),)}),
        ("components[0].axis", {"components": (beam(3, (7, 7, 1), "z"),)}),
        ("components[0].target_vox", {"components": (column(4, (3, 7, 1)),)}),
        ("components[0].target_vox", {"components": (column(4, (7, 7, 3)),)}),
        ("components[0].target_vox", {"components": (beam(4, (7, 7, 1), "x"),)}),
        ("components[1].target_vox", {"components": (column(4, (7, 7, 1)), beam(3, (6, 7, 3), "x"))}),
        ("components[0].after", {"components": (column(4, (7, 7, 1), after=(2,)),)}),
        ("components", {"components": (column(4, (7, 7, 1), after=(1,)),)}),
        ("components[0].start", {"components": (column(4, (7, 7, 1), start=YardPose(3, 7, "x")),)}),
        ("components[0].start", {"components": (column(4, (7, 7, 1), start=YardPose(12, 0, "x")),)}),
        ("components[0].start", {"components": (column(4, (7, 7, 1), start=YardPose(0, 0, "up")),)}),
        ("components[0].start", {"components": (beam(4, (6, 7, 1), "x", start=YardPose(0, 0, "y")),)}),
        ("components[0].start", {**NARROW, "components": (beam(7, (1, 7, 1), "x", start=YardPose(1, 0, "x")),)}),
        ("components[0].start", {**NARROW, "components": (beam(7, (1, 7, 1), "x"),)}),
        ("components[1].start", {"components": (column(4, (7, 7, 1), start=FLAT), column(4, (8, 7, 1), start=CROSS))}),
        ("obstructions[0]", {"obstructions": (((1, 1, 1), (1, 2, 2)),)}),
        ("obstructions[0]", {"obstructions": (((1, 1, 0), (2, 2, 2)),)}),
        ("obstructions[0]", {"obstructions": (((7, 7, 4), (8, 8, 6)),)}),
        ("random_obstructions", {"random_obstructions": RandomObstructions(3, 2)}),
        ("random_obstructions", {"random_obstructions": RandomObstructions(1, 2, 16, 2)}),
        ("step_limit", {"step_limit": 0}),
        ("max_steps", {"max_steps": 0}),
    ],
)  # fmt: skip
def test_impossible_values_are_refused_by_field(field, changes):
    with pytest.raises(ValueError) as refusal:
        replace(PAPER, **changes)
    assert str(refusal.value).startswith(field + ":"), refusal.value


def test_the_error_says_what_would_be_valid():
    with pytest.raises(ValueError, match="never turned"):
        PaperSpec((9, 9, 5), (3, 3, 6, 6), (beam(3, (3, 3, 1), "x", start=YardPose(0, 0, "y")),))
    assert isinstance(PAPER.components[0], PaperComponent)
