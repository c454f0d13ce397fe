"""Random numbers inside kernels: one splitmix64 generator for each row of an array, so that a copy draws the same.

Source: Steele, Lea, Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.compiled import leaf_kernel


@leaf_kernel
def drawn(generators: NDArray[np.uint64], row: int) -> float:
    """Return the next number of a generator, in [0, 1)."""
    generators[row] += np.uint64(0x9E3779B97F4A7C15)
    z = generators[row]
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    z = z ^ (z >> np.uint64(31))
    return float(z >> np.uint64(11)) * (1.0 / 9007199254740992.0)


def generators_of(seed: int, count: int) -> NDArray[np.uint64]:
    """Return (N,) uint64 generators of a seed."""
    return np.random.default_rng(seed).integers(2**64, size=count, dtype=np.uint64)
