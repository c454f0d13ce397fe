"""A small egocentric observation: a flat window around the component in transit, and the way to its target."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import leaf_kernel
from bimvox.paper.env.dynamics import may_be
from bimvox.paper.env.rules import SpecArrays
from bimvox.paper.env.state import PaperState, SiteState

WINDOW_WIDTH = 11
"""Cells of the window along x and y; odd, so that the component is in the middle."""

WINDOW_CELLS = WINDOW_WIDTH * WINDOW_WIDTH
WINDOW_OBSERVATION_SIZE = 2 * WINDOW_CELLS + 2 + 3


@leaf_kernel
def write_window(rules: SpecArrays, site: SiteState, state: PaperState, out: NDArray[np.float32]) -> None:
    """Write the window into ``out``, (247,) float32 in [-1, 1].

    In order: 11 x 11 whether the component is blocked there at its current height; 11 x 11 whether its target is there
    at any height; whether up and down are blocked; the offset of the target along x, y, z as a share of the site. Once
    everything is assembled, it shows the last component.
    """
    i = min(state.component, rules.boxes.shape[0] - 1)
    x, y, z = state.x, state.y, state.z
    half = WINDOW_WIDTH // 2
    n = 0
    for u in range(x - half, x + half + 1):
        for v in range(y - half, y + half + 1):
            out[n] = 0.0 if may_be(rules, site, i, u, v, z) else 1.0
            out[WINDOW_CELLS + n] = 1.0 if u == site.target[i, 0] and v == site.target[i, 1] else 0.0
            n += 1
    out[2 * WINDOW_CELLS] = 0.0 if may_be(rules, site, i, x, y, z + 1) else 1.0
    out[2 * WINDOW_CELLS + 1] = 0.0 if may_be(rules, site, i, x, y, z - 1) else 1.0
    nx, ny, nz = site.cells.shape
    out[2 * WINDOW_CELLS + 2] = (site.target[i, 0] - x) / nx
    out[2 * WINDOW_CELLS + 3] = (site.target[i, 1] - y) / ny
    out[2 * WINDOW_CELLS + 4] = (site.target[i, 2] - z) / nz
