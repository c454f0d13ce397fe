from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from paper_lessons import TINY

from bimvox.paper.env.layout import PaperLayout, random_layouts, yard_layouts
from bimvox.paper.env.spec import FOUR_COLUMNS_FOUR_BEAMS, PAPER, YardPose
from bimvox.paper.policy.baselines import Requirement, field_seconds, random_policy, tabular_q, teacher_moves


def test_the_teacher_takes_the_shortest_path_from_every_start():
    starts = yard_layouts(PAPER)
    expected = [abs(layout.starts[0].x - 7) + abs(layout.starts[0].y - 7) + 1 for layout in starts]
    assert teacher_moves(PAPER, starts).tolist() == expected


def test_the_teacher_says_if_there_is_no_path():
    boxes = (((0, 1, 1), (5, 2, 4)), ((0, 3, 1), (5, 4, 4)), ((1, 2, 1), (2, 3, 4)), ((3, 2, 1), (4, 3, 4)))
    walled = PaperLayout((YardPose(0, 4, "x"),), ((2, 2, 1),), boxes)
    assert teacher_moves(TINY, [walled]).tolist() == [-1]


def test_the_teacher_builds_the_frame():
    layouts = random_layouts(FOUR_COLUMNS_FOUR_BEAMS, 5, 0)
    assert (teacher_moves(FOUR_COLUMNS_FOUR_BEAMS, layouts) > 0).all()


def test_acting_at_random_seldom_arrives_on_the_papers_site():
    episodes = random_policy(PAPER, yard_layouts(PAPER), seed=0)
    assert np.mean([episode.succeeded for episode in episodes]) < 0.1


def test_a_table_learns_the_tiny_site():
    starts = yard_layouts(TINY)
    result = tabular_q(TINY, starts, seed=0, budget=20_000, required=Requirement(50, 50, 1_000))
    assert result.reached
    assert result.steps_to_success == result.curve[-1].steps < 20_000
    assert result.curve[-1].success_rate == 1.0
    # From (0, 2, 2), the best first value is a step plus the reward of arriving.
    best = result.table[1, 2, 2, 0].max()
    assert best == pytest.approx(-1.0 + 0.99 * 1.0, abs=0.2)
    again = tabular_q(TINY, starts, seed=0, budget=20_000, required=Requirement(50, 50, 1_000))
    np.testing.assert_array_equal(again.table, result.table)


def test_a_table_that_is_not_good_enough_in_time():
    result = tabular_q(TINY, yard_layouts(TINY), seed=0, budget=50, required=Requirement(10, 10))
    assert not result.reached
    assert result.steps_to_success is None
    assert [point.steps for point in result.curve] == [50]


def test_a_table_serves_one_target():
    drawn = random_layouts(replace(PAPER, random_targets=True), 5, 0)
    with pytest.raises(ValueError, match="one target"):
        tabular_q(PAPER, drawn, seed=0, budget=50, required=Requirement(1, 1))


def test_what_a_field_costs_is_measured():
    assert 0.0 < field_seconds(PAPER, fields=5) < 1.0
