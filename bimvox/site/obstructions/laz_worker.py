"""Decompression of a LAZ file in a separate process, because a damaged file can crash the decoder.

    python -m bimvox.site.obstructions.laz_worker FILE

Writes the points to stdout as float64 x, y, z.
"""

from __future__ import annotations

import sys

import numpy as np

_CHUNK = 1 << 20


def main(path: str) -> None:
    """Decompress a file to stdout."""
    import laspy

    with laspy.open(path) as file:
        for piece in file.chunk_iterator(_CHUNK):
            points = np.stack([piece.x, piece.y, piece.z], axis=1).astype(np.float64)
            sys.stdout.buffer.write(points.tobytes())


if __name__ == "__main__":
    main(sys.argv[1])
