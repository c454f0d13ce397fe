"""The limit on the size of a grid."""

from __future__ import annotations

CELL_LIMIT = 500_000_000
"""Most cells of a grid that is created or read, unless the caller allows more.

In bricks an office takes about 0.4 bytes per cell; a grid that differs in every cell takes 1 to 4.
"""
