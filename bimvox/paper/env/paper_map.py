"""The paper's observation: a map over (x, y) of six channels, heights in cells.

A height is the index k of the highest cell of an object: 0 for the slab, 1 for a component in the yard, 2 for an
obstruction two cells high, 5 for a column of four cells that hangs at k = 2. If several objects of one channel are
stacked, the highest counts. The channels:

0. ``Zi`` height of an obstruction, or of a stored component.
1. ``f`` 1 below the component in transit once it is late, otherwise 0.
2. ``Zt`` height of the component in transit.
3. ``Ztar`` height of the target of the component in transit; assembled components keep theirs.
4. ``arrived`` 1 at assembled components.
5. ``count`` the number of assembled components, at each of them.

With several components only the target of the one in transit is shown. Otherwise drawn targets could not be told apart.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import leaf_kernel
from bimvox.paper.env.component import STORED_LAYER
from bimvox.paper.env.dynamics import is_late, length_of, lying
from bimvox.paper.env.rules import SpecArrays
from bimvox.paper.env.state import PaperState, SiteState

CHANNELS = 6
INITIAL_HEIGHT, LATE, TRANSIT_HEIGHT, TARGET_HEIGHT, ARRIVED, COUNT = range(CHANNELS)


@leaf_kernel
def write_map(rules: SpecArrays, site: SiteState, state: PaperState, out: NDArray[np.float32]) -> None:
    """Write the map of a state into ``out``, (X, Y, 6) float32."""
    out[:] = 0.0
    for m in range(site.obstructions.shape[0]):
        x0, y0, _, x1, y1, z1 = site.obstructions[m]
        _raise_to(out, x0, y0, x1, y1, INITIAL_HEIGHT, z1 - 1)
    count = rules.boxes.shape[0]
    for i in range(count):
        if i > state.component:
            x, y = site.stored[i, 0], site.stored[i, 1]
            dx, dy = lying(length_of(rules, i), site.stored[i, 2])
            _raise_to(out, x, y, x + dx, y + dy, INITIAL_HEIGHT, STORED_LAYER)
        else:
            x, y, z = site.target[i]
            dx, dy, dz = rules.boxes[i, 3:]
            _raise_to(out, x, y, x + dx, y + dy, TARGET_HEIGHT, z + dz - 1)
            if i < state.component:
                _raise_to(out, x, y, x + dx, y + dy, ARRIVED, 1)
                _raise_to(out, x, y, x + dx, y + dy, COUNT, state.component)
    if state.component < count:
        i = state.component
        late = 1.0 if is_late(rules, state) else 0.0
        for x in range(state.x, state.x + rules.boxes[i, 3]):
            for y in range(state.y, state.y + rules.boxes[i, 4]):
                out[x, y, LATE] = late
                out[x, y, TRANSIT_HEIGHT] = state.z + rules.boxes[i, 5] - 1


@leaf_kernel
def _raise_to(out: NDArray[np.float32], x0: int, y0: int, x1: int, y1: int, channel: int, value: int) -> None:
    for x in range(x0, x1):
        for y in range(y0, y1):
            out[x, y, channel] = max(out[x, y, channel], np.float32(value))
