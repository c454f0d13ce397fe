"""``bimvox export`` of a grid."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from bimvox.exporters.formats import Format
from bimvox.files import check_output, default_output
from bimvox.progress import Progress


def export_grid(source: Path, wanted: Format, out: Path | None, progress: Progress) -> dict[str, Any]:
    """Write a grid in another format, and return the document of ``bimvox export --json``.

    ``out`` defaults to the grid's name with another suffix, in the current folder.

    Raises:
        InputError: If the grid or the output cannot be used; nothing is written then.
    """
    from bimvox.grid.storage import read_grid
    from bimvox.library.export import write_grid

    target = out or default_output(source, wanted.suffix)
    check_output(target, inputs=[source])
    progress.stage("read")
    with source.open("rb") as stream:
        grid = read_grid(stream, source.name)
    document: dict[str, Any] = {
        "out": str(target),
        "format": wanted.name,
        "messages": 0,
        "lifts": 0,
        "cells": math.prod(grid.shape),
        "parts": len(grid.parts),
    }
    if (triangles := write_grid(grid, wanted, target, inputs=[source], progress=progress)) is not None:
        document["triangles"] = triangles
    progress.finish()
    return {**document, "seconds": progress.seconds}
