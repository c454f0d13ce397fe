from __future__ import annotations

import hashlib
import json
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.freeze_suite import frozen_text
from benchmarks.train_generalist import lesson, lessons
from bimvox.env.problem import UNREACHABLE, is_learnable
from bimvox.errors import PolicyError
from bimvox.grid.summed_area import summed_area_table
from bimvox.planning.search import shortest_path
from bimvox.policy.generalist.problems import (
    FAMILIES,
    HELD_OUT_DOMAIN,
    LEAST_MOVES,
    LESSON_DOMAIN,
    VALIDATION_DOMAIN,
    occupancy_of,
    random_problem,
    with_boxes,
)
from bimvox.policy.generalist.suite import (
    BUILDING,
    FROZEN,
    ProblemSet,
    digest_of,
    frozen_digests,
    frozen_problem,
    held_out,
    problem_sets,
    set_digest,
    unsolvable,
    wide_trap,
)
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


def test_the_frozen_file_has_every_problem_once_and_is_small():
    digests, sets = frozen_digests(), problem_sets()
    assert list(digests) == list(sets)
    assert [len(digests[name]) for name in sets] == [one.count for one in sets.values()]
    every = [digest for of_set in digests.values() for digest in of_set]
    assert len(set(every)) == len(every)
    document = json.loads(FROZEN.read_text())
    assert all(one["digest"] == set_digest(one["digests"]) for one in document["sets"].values())
    assert FROZEN.stat().st_size < 60_000


def test_the_lifts_of_the_building_are_a_small_file_with_a_hash():
    document = json.loads(FROZEN.read_text())["sets"]["building"]
    assert (document["file"], document["sha256"]) == (BUILDING.name, hashlib.sha256(BUILDING.read_bytes()).hexdigest())
    assert BUILDING.stat().st_size < 300_000
    lifts = [frozen_problem(problem_sets()["building"], number) for number in (0, 100)]
    assert any(lift.space.cleared.size for lift in lifts)
    assert all(lift.distance_from(lift.start_vox) >= LEAST_MOVES for lift in lifts)


@pytest.mark.parametrize("name", problem_sets())
def test_a_sample_of_the_problems_is_the_frozen_one(name):
    one = problem_sets()[name]
    for number in (0, 1, one.count - 2):
        assert digest_of(one.make(number)) == frozen_digests()[name][number]


@pytest.mark.slow
def test_every_problem_is_the_frozen_one():
    assert frozen_text() == FROZEN.read_text()


def test_a_digest_is_of_everything_that_decides_a_problem():
    problem = problem_sets()["boxes"].make(0)
    assert problem.distance is not None
    space = problem.space
    occupied = occupancy_of(space)
    occupied[-1, -1, -1] ^= True
    others = [
        replace(problem, space=space._replace(table=summed_area_table(occupied))),
        replace(problem, space=space._replace(boxes=space.boxes + np.int32(1))),
        replace(problem, space=space._replace(hook_offset=space.hook_offset + np.int32(1))),
        replace(problem, space=space._replace(hook_floor=space.hook_floor + np.int32(1))),
        replace(problem, space=space._replace(hook_ceiling=space.hook_floor + np.int32(9))),
        replace(problem, space=space._replace(cleared=np.ones((1, 1, 1), np.bool_))),
        replace(problem, space=space._replace(cleared=np.ones((1, 1, 2), np.bool_))),
        replace(problem, target_vox=(0, 0, 0)),
        replace(problem, start_vox=problem.target_vox),
        replace(problem, distance=problem.distance + np.int16(1)),
    ]
    assert len({digest_of(one) for one in (problem, *others)}) == 1 + len(others)


def test_a_problem_that_is_not_the_frozen_one_is_refused():
    frames, slabs = problem_sets()["frames"], problem_sets()["slabs"]
    other = ProblemSet("frames", frames.count, slabs.make)
    with pytest.raises(PolicyError, match="problem 3 of frames is not the frozen one"):
        frozen_problem(other, 3)
    assert frozen_problem(frames, 3).distance_from(frozen_problem(frames, 3).start_vox) > 0
