"""The curve of a training as a CSV file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from bimvox.files import write_atomically

if TYPE_CHECKING:
    from bimvox.policy.trained import CurvePoint


def write_curve(file: Path, curve: tuple[CurvePoint, ...]) -> None:
    """Write a curve as CSV: steps, success rate, mean path / shortest path."""
    rows = [f"{p.steps},{p.success_rate:.6f},{p.length_ratio:.6f}" for p in curve]
    write_atomically(file, ("\n".join(["steps,success_rate,length_ratio", *rows]) + "\n").encode(), inputs=[])
