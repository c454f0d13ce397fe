"""Random changes of an obstruction file: boxes added, moved, removed, on paths, in the yard, on targets, anywhere."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from bimvox.records.lift import LiftPlan

MOST = 4
"""Largest number of obstructions."""
_ON_A_PATH = 0.7
_SIZE_VOX = (0.4, 3.0)


class RandomObstructions:
    """Obstructions that change at random, a few at a time.

    Args:
        plan: A plan of the site; obstructions matter near its lifts.
        seed: The same seed gives the same changes.
    """

    def __init__(self, plan: LiftPlan, seed: int) -> None:
        self._site = plan.site
        self._lifts = [lift for lift in plan.lifts if lift.path_vox is not None]
        self._rng = np.random.default_rng(seed)
        self._boxes: dict[str, dict[str, list[float]]] = {}
        self._count = 0

    def change(self) -> bytes:
        """Add, move or remove an obstruction, and return the file's new content; it differs from the previous one."""
        before = self.content()
        while True:
            what = self._rng.choice(["add", "move", "remove"])
            names = list(self._boxes)
            if what == "add" and len(names) < MOST:
                self._count += 1
                self._boxes[f"box {self._count}"] = self._box()
            elif what == "move" and names:
                self._boxes[str(self._rng.choice(names))] = self._box()
            elif what == "remove" and names:
                del self._boxes[str(self._rng.choice(names))]
            if self.content() != before:
                return self.content()

    def content(self) -> bytes:
        """Return the file's content."""
        entries: list[dict[str, Any]] = [{"id": name, "box": box} for name, box in self._boxes.items()]
        return json.dumps({"version": 1, "unit": "m", "obstructions": entries}).encode()

    def _box(self) -> dict[str, list[float]]:
        rng, frame = self._rng, self._site.frame
        size_m = frame.voxel_size_m
        if rng.random() < _ON_A_PATH:
            path = self._lifts[int(rng.integers(len(self._lifts)))].path_vox
            assert path is not None
            cell = path[int(rng.integers(len(path)))]
        else:
            cell = rng.integers((0, 0, 1), self._site.shape)
        low = frame.corner_of(cell) + 0.1 * size_m
        high = low + size_m * rng.uniform(*_SIZE_VOX, size=3)
        return {"min": np.round(low, 4).tolist(), "max": np.round(high, 4).tolist()}
