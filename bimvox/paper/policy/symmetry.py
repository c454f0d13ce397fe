"""The eight rotations and mirrorings of a site in plan, applied to the egocentric observation.

The rules are the same in every direction in plan and in a mirror. A rotated or mirrored transition is therefore a
possible transition on the rotated or mirrored site, with the same reward. With gradient steps on such images (data
augmentation), one environment step teaches as much as eight.

The images are exact: the windows are square in plan and centred on the component on every level, whatever its shape.
The way to the goal and the last action are transformed with them.
"""

from __future__ import annotations

import itertools

import numpy as np
import torch

from bimvox.env.actions import ACTION_COUNT, MOVES
from bimvox.env.observation import WAY_SIZE
from bimvox.paper.env.pyramid import OBSERVATION_SIZE, SCALES, WINDOW, WINDOW_SIZE
from bimvox.policy.replay import Transitions

IMAGES = 8


class Images:
    """Replaces each of some transitions by a drawn image; image 0 is the original itself.

    Attributes:
        entry: (8, size) int64; entry n of image g is entry ``entry[g, n]`` of the original,
        sign: (8, size) float32, times this.
        action: (8, 6) int64 the image of each action.
    """

    def __init__(self) -> None:
        entry = np.zeros((IMAGES, OBSERVATION_SIZE), np.int64)
        sign = np.ones((IMAGES, OBSERVATION_SIZE), np.float32)
        action = np.zeros((IMAGES, ACTION_COUNT), np.int64)
        levels = np.arange(WINDOW_SIZE * len(SCALES)).reshape(len(SCALES), *WINDOW)
        goal = np.arange(WAY_SIZE).reshape(-1, 3) + levels.size
        for g, (swap, mirror_x, mirror_y) in enumerate(itertools.product((False, True), repeat=3)):
            window, way, moves = levels, goal, MOVES
            turns = np.ones(3, np.float32)
            if swap:
                window, way, moves = window.swapaxes(1, 2), way[:, [1, 0, 2]], moves[:, [1, 0, 2]]
            for axis, mirrored in enumerate((mirror_x, mirror_y)):
                if mirrored:
                    window = np.flip(window, axis + 1)
                    turns[axis] = -1.0
            image = [MOVES.tolist().index((move * turns.astype(np.int32)).tolist()) for move in moves]
            action[g] = image
            entry[g, : levels.size] = window.ravel()
            entry[g, levels.size : levels.size + WAY_SIZE] = way.ravel()
            sign[g, levels.size : levels.size + WAY_SIZE] = np.tile(turns, WAY_SIZE // 3)
            entry[g, levels.size + WAY_SIZE :] = np.argsort(image) + levels.size + WAY_SIZE
        self.entry, self.sign, self.action = (torch.from_numpy(table) for table in (entry, sign, action))

    def __call__(self, batch: Transitions, random: torch.Generator) -> Transitions:
        """Return one image of each transition, drawn evenly."""
        return self.of(batch, torch.randint(IMAGES, (len(batch.rows),), generator=random))

    def of(self, batch: Transitions, which: torch.Tensor) -> Transitions:
        """Return the images of some transitions; ``which`` is (N,) 0 .. 7."""
        entry, sign = self.entry[which], self.sign[which]
        return batch._replace(
            views=sign * batch.views.gather(1, entry),
            following=sign * batch.following.gather(1, entry),
            actions=self.action[which].gather(1, batch.actions),
        )
