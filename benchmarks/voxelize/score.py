"""How a tool's answers compare with the truth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.voxelize.oracle import Truth, union_truth
from benchmarks.voxelize.tool import ToolInfo


@dataclass(frozen=True, slots=True)
class Score:
    """Right and wrong cells in all windows of a case.

    Attributes:
        filled: Cells that must be set: of a surface, those that a boundary runs through; of a solid, those inside too.
        missed: Of these, how many are not set.
        extra: Cells that are set although no part fills any of them.
    """

    filled: int
    missed: int
    extra: int

    @property
    def missed_share(self) -> float:
        """Missed cells per filled cell."""
        return self.missed / max(1, self.filled)

    @property
    def extra_share(self) -> float:
        """Extra cells per filled cell."""
        return self.extra / max(1, self.filled)


def judge(tool: ToolInfo, truths: Sequence[NDArray[np.uint8]], masks: Sequence[NDArray[np.bool_]]) -> Score:
    """Compare a tool's masks with the truth, window by window.

    Args:
        tool: A tool that distinguishes parts is judged part by part, others on all parts together.
        truths: Per window (P, A, B, C) uint8, values of ``Truth``.
        masks: Per window (P, A, B, C) or (A, B, C) bool.
    """
    filled = missed = extra = 0
    for truth, mask in zip(truths, masks, strict=True):
        told = truth if tool.by_part else union_truth(truth)
        # A surface need not set cells inside one part of a union: they are not on its boundary.
        must = told == Truth.BOUNDARY
        if tool.solid:
            must |= told == Truth.INSIDE
        filled += int(np.count_nonzero(must))
        missed += int(np.count_nonzero(must & ~mask))
        extra += int(np.count_nonzero((told == Truth.EMPTY) & mask))
    return Score(filled, missed, extra)


def unpacked(bits: NDArray[np.uint8], tool: ToolInfo, truth: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """Return a window's masks as the worker packed them."""
    shape = truth.shape if tool.by_part else truth.shape[1:]
    return np.unpackbits(bits, count=int(np.prod(shape))).reshape(shape).astype(np.bool_)
