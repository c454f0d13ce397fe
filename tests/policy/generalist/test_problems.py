from __future__ import annotations

import numpy as np
import pytest

from benchmarks.train_generalist import lesson, lessons
from bimvox.env.problem import UNREACHABLE, is_learnable
from bimvox.planning.search import shortest_path
from bimvox.policy.generalist.problems import (
    FAMILIES,
    HELD_OUT_DOMAIN,
    LESSON_DOMAIN,
    VALIDATION_DOMAIN,
    occupancy_of,
    random_problem,
    with_boxes,
)
from bimvox.policy.generalist.suite import held_out, unsolvable, wide_trap
from bimvox.site.collision import HOOK_FORBIDDEN, placement_is_free

SMALL, LARGE = (15, 15, 6), (40, 30, 14)


@pytest.mark.parametrize("family", FAMILIES)
def test_every_problem_can_be_learned_and_is_its_seeds(family):
    ropes = set()
    for number in range(12):
        problem = random_problem((9, number), family, SMALL, LARGE)
        assert is_learnable(problem)
        assert all(a <= b <= c for a, b, c in zip(SMALL, problem.grid_shape, LARGE, strict=True))
        assert placement_is_free(problem.space, *problem.start_vox)
        assert problem.distance_from(problem.start_vox) >= 4
        assert occupancy_of(problem.space)[:, :, 0].all()
        again = random_problem((9, number), family, SMALL, LARGE)
        np.testing.assert_array_equal(again.space.table, problem.space.table)
        np.testing.assert_array_equal(again.starts_vox, problem.starts_vox)
        floor = problem.space.hook_floor
        ropes.add(bool((floor[floor < HOOK_FORBIDDEN] > 0).any()))
    assert ropes == {False, True}


def test_lessons_tests_and_checks_share_no_seed():
    assert len({LESSON_DOMAIN, HELD_OUT_DOMAIN, VALIDATION_DOMAIN}) == 3
    tables = [lesson(3, domain).space.table for domain in (LESSON_DOMAIN, VALIDATION_DOMAIN)]
    tables.append(held_out("slabs", 3).problem.space.table)
    assert len({(table.shape, table.tobytes()) for table in tables}) == 3


def test_threads_make_the_same_lessons():
    for one, other in zip(lessons(6), lessons(6, threads=3), strict=True):
        np.testing.assert_array_equal(one.space.table, other.space.table)
        assert (one.start_vox, one.target_vox) == (other.start_vox, other.target_vox)


@pytest.mark.parametrize("number", range(6))
def test_unsolvable_lifts_have_no_path(number):
    problem = unsolvable(number)
    assert placement_is_free(problem.space, *problem.start_vox)
    assert placement_is_free(problem.space, *problem.target_vox)
    assert problem.distance_from(problem.start_vox) == UNREACHABLE
    assert shortest_path(problem.space, problem.start_vox, problem.target_vox).path_vox is None


def test_a_wide_trap_asks_for_a_way_around():
    problem = wide_trap(0.1, 0)
    straight = np.abs(np.subtract(problem.start_vox, problem.target_vox)).sum()
    assert problem.distance_from(problem.start_vox) > straight


def test_added_boxes_stand_and_the_hook_keeps_above_them():
    problem = random_problem((9, 1), "frames", SMALL, LARGE)
    space = problem.space._replace(hook_floor=np.ones_like(problem.space.hook_floor))
    boxed = with_boxes(np.random.default_rng(0), space, 5)
    before, after = occupancy_of(space), occupancy_of(boxed)
    assert (after | before == after).all()
    assert after.sum() > before.sum()
    tops = np.where((after & ~before).any(axis=2), after.shape[2] - np.argmax((after & ~before)[:, :, ::-1], axis=2), 0)
    assert (boxed.hook_floor >= tops).all()
