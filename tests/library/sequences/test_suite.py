import re
from itertools import combinations

import numpy as np
import pytest

from bimvox.errors import InputError
from bimvox.library.sequences import suite
from bimvox.library.sequences.buildings import Precast
from bimvox.library.sequences.suite import GeneratedProblem, digest_of, frozen_digests, frozen_site, sequence_problems

PROBLEMS = [problem for each in sequence_problems().values() for problem in each]


def test_every_problem_has_a_name_and_a_frozen_digest():
    names = [problem.name for problem in PROBLEMS]
    assert len(set(names)) == len(names)
    assert set(names) | {"samples-0"} == set(frozen_digests())


@pytest.mark.parametrize("problem", PROBLEMS, ids=lambda one: one.name)
def test_problems_are_the_frozen_ones(problem):
    site = frozen_site(problem)
    assert len(site.cranes) == problem.cranes
    assert {part.means.value for part in site.components} == {"crane"}


def test_another_building_is_refused(monkeypatch):
    other = GeneratedProblem("small-0", Precast((2, 0), seed=99))
    with pytest.raises(InputError, match="small-0 is not the frozen problem: its digest is"):
        frozen_site(other)


def test_a_digest_covers_masses_and_cranes():
    one = GeneratedProblem("one", Precast((1, 0)))
    two = GeneratedProblem("one", Precast((1, 0)), cranes=1)
    assert digest_of(one.site()) == digest_of(two.site())
    site = two.site()
    object.__setattr__(site.site.components[0], "mass_kg", 1.0)
    assert digest_of(site) != digest_of(one.site())


def test_the_parts_of_a_building_stand_next_to_each_other_and_not_in_each_other():
    building = Precast((2, 1), storeys=2, slabs=2, seed=3).building()
    boxes = {element.name: element.mesh.bounds_m for element in building.elements}
    assert len(boxes) == len(building.elements) == 2 * (6 + 4 + 3 + 4)
    for (_, a), (_, b) in combinations(boxes.items(), 2):
        assert (np.minimum(a[1], b[1]) - np.maximum(a[0], b[0])).min() < 1e-9
    assert all(element.mesh.signed_volume_m3 > 0 for element in building.elements)


def test_the_same_seed_gives_the_same_building():
    one, same, other = (Precast((2, 1), seed=seed) for seed in (4, 4, 5))
    assert one.lines_m == same.lines_m != other.lines_m
    assert all(re.fullmatch(r"[0-9a-f]{16}", digest) for digest in frozen_digests().values())
    assert suite.FROZEN.name == "suite.json"
