"""How large a grid may be."""

from __future__ import annotations

CELL_LIMIT = 500_000_000
"""Most cells that a grid is made with, or read with, unless the caller allows more.

A labelled grid takes 5 bytes a cell, 9 while it is made.
"""
