from __future__ import annotations

import hashlib
import json
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.freeze_suite import frozen_text
from bimvox.errors import PolicyError
from bimvox.grid.summed_area import summed_area_table
from bimvox.policy.generalist.problems import LEAST_MOVES, occupancy_of
from bimvox.policy.generalist.suite import (
    BUILDING,
    FROZEN,
    ProblemSet,
    digest_of,
    frozen_digests,
    frozen_problem,
    problem_sets,
    set_digest,
)


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
