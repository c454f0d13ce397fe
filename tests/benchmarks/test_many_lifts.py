from __future__ import annotations

from benchmarks.many_lifts import methods
from benchmarks.many_lifts.problems import PARTS, make


def test_every_lift_has_a_path_that_the_search_finds():
    problems = make(len(PARTS), seed=1)
    assert problems.kind.tolist() == list(range(len(PARTS)))
    found = methods.search(problems, len(PARTS))
    assert all(found.found)
    for lift, moves in zip(problems.lifts, found.moves, strict=True):
        assert moves >= sum(abs(a - b) for a, b in zip(lift.start_vox, lift.target_vox, strict=True))
