"""Connected components of a graph, in plain numpy (importing SciPy's takes longer than most files take to read)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def connected_labels(count: int, a: NDArray[np.int64], b: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return, for each of ``count`` nodes, the lowest node that it is connected to.

    Args:
        count: Number of nodes.
        a: (E,) one end of each edge.
        b: (E,) the other end.
    """
    root = np.arange(count, dtype=np.int64)
    while True:
        low, high = np.minimum(root[a], root[b]), np.maximum(root[a], root[b])
        if (low == high).all():
            return root
        np.minimum.at(root, high, low)
        while not np.array_equal(root, up := root[root]):
            root = up
