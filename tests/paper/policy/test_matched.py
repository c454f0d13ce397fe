"""Pairs of obstructions that are alike in all but the end of the path that they are close to."""

from __future__ import annotations

import numpy as np
import pytest

from bimvox.paper.env.presets import PAPER
from bimvox.paper.policy import scenarios as matched
from bimvox.paper.policy.baselines import teacher_moves
from bimvox.paper.policy.config import PAPER_MODE
from bimvox.paper.policy.episodes import replay
from bimvox.paper.policy.initialization import AppliedPolicy
from bimvox.paper.policy.scenarios import matched_pairs

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
    monkeypatch.setattr(matched, "apply_layout", apply_layout)
    monkeypatch.setattr(matched, "trial_episodes", lambda network, spec, config, layout, count, seed: layout)
    monkeypatch.setattr(matched, "enough_succeed", lambda config, layout: copes["accepts"](layout))
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
