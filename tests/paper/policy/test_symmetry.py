from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bimvox.paper.env.batched import BatchedPaperSite
from bimvox.paper.env.component import YardPose, beam
from bimvox.paper.env.spec import PaperSpec
from bimvox.paper.policy.symmetry import IMAGES, symmetry, write_images
from bimvox.policy.learner.arrays import Memory

SIDE = 9


def point(g, x, y):
    """Return the cell to which image g moves a cell on plan."""
    swap, mirror_x, mirror_y = g >= 4, g % 4 >= 2, g % 2 == 1
    if swap:
        x, y = y, x
    return (SIDE - 1 - x if mirror_x else x), (SIDE - 1 - y if mirror_y else y)


def box(g, low, high):
    """Return the box to which image g moves a box."""
    ends = [point(g, *low[:2]), point(g, high[0] - 1, high[1] - 1)]
    (x0, x1), (y0, y1) = (sorted(values) for values in zip(*ends, strict=True))
    return (x0, y0, low[2]), (x1 + 1, y1 + 1, high[2])


def site(g):
    """Return image g of an asymmetric site with a hanging beam."""
    low, _ = box(g, (2, 6, 3), (5, 7, 4))
    start_low, start_high = box(g, (0, 1, 1), (3, 2, 2))
    axis = "x" if start_high[0] - start_low[0] > 1 else "y"
    part = beam(3, low, axis)
    part = replace(part, start=YardPose(*start_low[:2], axis), after=())
    obstructions = tuple(box(g, *b) for b in [((4, 0, 1), (5, 4, 5)), ((0, 3, 1), (2, 4, 3)), ((6, 2, 1), (7, 8, 4))])
    area = box(g, (2, 6, 0), (8, 9, 1))
    return PaperSpec((SIDE, SIDE, 7), (*area[0][:2], *area[1][:2]), (part,), obstructions=obstructions)


def walk(g, actions):
    """Return the observations and rewards of image g of a walk."""
    batch = BatchedPaperSite(site(g), 1, observation="egocentric", reward="shaped", threads=1)
    seen, earned = [batch.reset()[0].copy()], []
    for action in actions:
        step = batch.step([symmetry().action[g, action]])
        seen.append(step.observations[0].copy())
        earned.append(float(step.rewards[0]))
    return np.array(seen), np.array(earned, np.float32)


@pytest.mark.parametrize("g", range(IMAGES))
def test_a_walk_on_a_turned_site_is_the_turned_walk(g):
    actions = np.random.default_rng(1).integers(6, size=40)
    seen, earned = walk(0, actions)
    turned, turned_earned = walk(g, actions)
    np.testing.assert_array_equal(turned_earned, earned)
    count, size = len(actions), seen.shape[1]
    zeros = np.zeros(count, np.float32)
    memory = Memory(seen[:-1], seen[1:], actions, earned, zeros, zeros)
    out = Memory(
        np.zeros((count, size), np.float32),
        np.zeros((count, size), np.float32),
        actions.copy(),
        zeros.copy(),
        zeros.copy(),
        zeros.copy(),
    )
    write_images(symmetry(), memory, np.arange(count), np.full(count, g), out)
    np.testing.assert_array_equal(out.observations, turned[:-1])
    np.testing.assert_array_equal(out.following, turned[1:])
    np.testing.assert_array_equal(out.actions, symmetry().action[g, actions])
    np.testing.assert_array_equal(out.rewards, earned)


def test_eight_different_images_the_first_the_original():
    tables = symmetry()
    assert len({tuple(row) for row in tables.action.tolist()}) == IMAGES
    np.testing.assert_array_equal(tables.action[0], np.arange(6))
    np.testing.assert_array_equal(tables.entry[0], np.arange(tables.entry.shape[1]))
    assert (tables.action[:, 4:] == [4, 5]).all()
