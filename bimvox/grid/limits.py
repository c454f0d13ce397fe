"""How large a grid may be."""

from __future__ import annotations

CELL_LIMIT = 500_000_000
"""Most cells that a grid is made with, or read with, unless the caller allows more.

In bricks an office takes about 0.4 bytes a cell, a grid that is different in every cell 1 to 4.
"""
