from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from bimvox.paper.env.batched import BatchedPaperSite
from bimvox.paper.env.spec import PaperSpec, YardPose, beam
from bimvox.paper.policy.learning import IMAGES, Images
from bimvox.policy.replay import Transitions

SIDE = 9
IMAGE = Images()


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
        step = batch.step([IMAGE.action[g, action].item()])
        seen.append(step.observations[0].copy())
        earned.append(float(step.rewards[0]))
    return np.array(seen), np.array(earned, np.float32)


@pytest.mark.parametrize("g", range(IMAGES))
def test_a_walk_on_a_turned_site_is_the_turned_walk(g):
    actions = np.random.default_rng(1).integers(6, size=40)
    seen, earned = walk(0, actions)
    turned, turned_earned = walk(g, actions)
    np.testing.assert_array_equal(turned_earned, earned)
    count = len(actions)
    columns = (torch.from_numpy(column)[:, None] for column in (actions, earned, np.zeros(count, np.float32)))
    before, after = (torch.from_numpy(rows) for rows in (seen[:-1], seen[1:]))
    batch = Transitions(before, *columns, after, torch.zeros(0, 6), torch.arange(count))
    image = IMAGE.of(batch, torch.full((count,), g))
    np.testing.assert_array_equal(image.views, turned[:-1])
    np.testing.assert_array_equal(image.following, turned[1:])
    np.testing.assert_array_equal(image.actions[:, 0], IMAGE.action[g][actions])
    np.testing.assert_array_equal(image.rewards[:, 0], earned)


def test_eight_different_images_the_first_the_original():
    assert len({tuple(row) for row in IMAGE.action.tolist()}) == IMAGES
    np.testing.assert_array_equal(IMAGE.action[0], np.arange(6))
    np.testing.assert_array_equal(IMAGE.entry[0], np.arange(IMAGE.entry.shape[1]))
    assert (IMAGE.action[:, 4:] == torch.tensor([4, 5])).all()
