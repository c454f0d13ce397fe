"""Pairs of obstructions that are alike in all but the end of the path that they are close to."""

from __future__ import annotations

import numpy as np
import pytest

from bimvox.errors import PlanningError
from bimvox.paper.env.layout import PaperLayout, check_layout, random_layouts
from bimvox.paper.env.spec import PAPER, YardPose, overlap
from bimvox.paper.policy import scenarios
from bimvox.paper.policy.baselines import teacher_moves
from bimvox.paper.policy.config import PAPER_MODE
from bimvox.paper.policy.episodes import replay
from bimvox.paper.policy.initialization import AppliedPolicy
from bimvox.paper.policy.scenarios import make_scenarios, matched_pairs

TARGET = (7, 7, 1)


def path_of(layout):
    """Return a path along x, then along y, then down."""
    start = layout.starts[0]
    x, y = start.x, start.y
    cells = [(x, y, 2)]
    while x != TARGET[0]:
        x += 1 if x < TARGET[0] else -1
        cells.append((x, y, 2))
    while y != TARGET[1]:
        y += 1 if y < TARGET[1] else -1
        cells.append((x, y, 2))
    return [*cells, TARGET]


def long_enough(layout):
    start = layout.starts[0]
    return abs(start.x - 7) + abs(start.y - 7) >= 6


LAYOUTS = [layout for layout in random_layouts(PAPER, 40, 0) if long_enough(layout)][:12]


@pytest.mark.parametrize("layout", LAYOUTS, ids=lambda layout: "{0.x}-{0.y}-{0.axis}".format(*layout.starts))
def test_obstructions_are_on_the_path_and_leave_another_path(layout):
    path = path_of(layout)
    scenarios = make_scenarios(PAPER, layout, path)
    assert list(scenarios) == ["a", "b", "c", "d"]
    assert scenarios["a"] == layout
    for name, count in (("b", 1), ("c", 2), ("d", 1)):
        changed = scenarios[name]
        check_layout(PAPER, changed)  # never on a start or a target
        assert len(changed.obstructions) == count
        for low, high in changed.obstructions:
            assert sorted(high[a] - low[a] for a in range(3)) == [1, 2, 3]
            assert (low[2], high[2]) == (1, 3)
            assert min(low) >= 0
            assert all(high[a] <= PAPER.shape[a] for a in range(3))
        column = PAPER.components[0]
        assert any(overlap(column.box_at(cell), box) for cell in path for box in changed.obstructions)
        assert 0 < teacher_moves(PAPER, [changed])[0] <= PAPER.steps_allowed


def test_close_to_the_start_and_close_to_the_target():
    layout = PaperLayout((YardPose(0, 7, "y"),), (TARGET,))
    path = path_of(layout)
    scenarios = make_scenarios(PAPER, layout, path)
    ((low, _),) = scenarios["b"].obstructions
    assert low == (1, 6, 1)  # across the first move, its middle on the path
    ((low, _),) = scenarios["d"].obstructions
    assert low == (6, 6, 1)  # across the last move
    first, second = scenarios["c"].obstructions
    assert first[0][0] == second[0][0] == 1
    assert abs(first[0][1] - second[0][1]) == 3  # end to end


def test_the_longest_detour_counts():
    layout = PaperLayout((YardPose(0, 6, "y"),), (TARGET,))
    scenarios = make_scenarios(PAPER, layout, path_of(layout))
    straight = teacher_moves(PAPER, [layout])[0]
    assert teacher_moves(PAPER, [scenarios["b"]])[0] > straight
    assert teacher_moves(PAPER, [scenarios["c"]])[0] > straight


def test_a_path_too_short_for_two_places():
    layout = PaperLayout((YardPose(4, 7, "y"),), (TARGET,))
    with pytest.raises(PlanningError, match="too short"):
        make_scenarios(PAPER, layout, path_of(layout))


LEFT, RIGHT, FORWARD, BACKWARD, DOWN = 2, 3, 0, 1, 5


@pytest.fixture
def straight(monkeypatch):
    """A policy that plans straight to the target, and succeeds on the sites that ``copes`` accepts."""

    def apply_layout(network, spec, config, layout, *, seed):
        start = layout.starts[0]
        for action in (LEFT, RIGHT, FORWARD, BACKWARD):
            episode = replay(spec, layout, np.array([action] * 30, np.int64))
            cells = [cell[:2] for cell in episode.path_cells]
            if (7, 7) in cells:
                return AppliedPolicy(replay(spec, layout, np.array([action] * cells.index((7, 7)) + [DOWN])), 1.0)
        raise AssertionError(f"{start} is not in line with the target")

    copes = {"accepts": lambda layout: False}
    monkeypatch.setattr(scenarios, "apply_layout", apply_layout)
    monkeypatch.setattr(scenarios, "trial_episodes", lambda network, spec, config, layouts, seed: layouts[0])
    monkeypatch.setattr(scenarios, "enough_succeed", lambda config, layout: copes["accepts"](layout))
    return copes


def test_both_ends_force_the_same_detour_on_the_same_path(straight):
    pairs = matched_pairs(None, PAPER, PAPER_MODE, seed=0, count=5)
    assert len({pair.near.starts for pair in pairs}) == 5
    for pair in pairs:
        start = pair.near.starts[0]
        assert pair.far.starts == pair.near.starts
        assert 7 in (start.x, start.y)
        bare, near, far = teacher_moves(PAPER, [_bare(pair.near), pair.near, pair.far]).tolist()
        assert near == far == bare + pair.detour_moves > bare
        for changed in (pair.near, pair.far):
            assert replay(PAPER, changed, pair.planned.moves).bumped.any()
        assert _distance(pair.near, (start.x, start.y)) < _distance(pair.far, (start.x, start.y))
        assert _distance(pair.far, (7, 7)) < _distance(pair.near, (7, 7))


def test_a_site_on_which_the_loaded_network_copes_is_in_no_pair(straight):
    first = matched_pairs(None, PAPER, PAPER_MODE, seed=0, count=5)
    mastered = {pair.near for pair in first} | {pair.far for pair in first}
    straight["accepts"] = lambda layout: layout in mastered
    again = matched_pairs(None, PAPER, PAPER_MODE, seed=0, count=5)
    assert not mastered & ({pair.near for pair in again} | {pair.far for pair in again})
    straight["accepts"] = lambda layout: True
    assert matched_pairs(None, PAPER, PAPER_MODE, seed=0, count=5) == ()


def _bare(layout):
    return type(layout)(layout.starts, layout.targets)


def _distance(layout, place):
    (low, high), *_ = layout.obstructions
    return sum(max(low[a] - place[a], place[a] - (high[a] - 1), 0) for a in range(2))
