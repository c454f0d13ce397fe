"""``bimvox export`` of a grid."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from bimvox.errors import InputError
from bimvox.exporters.formats import Format
from bimvox.files import check_output, default_output, write_atomically
from bimvox.progress import Progress

_THREADS = 2


def export_grid(source: Path, wanted: Format, out: Path | None, progress: Progress) -> dict[str, Any]:
    """Write a grid in another format, and return the document of ``bimvox export --json``.

    ``out`` defaults to the grid's name with another suffix, in the current folder.

    Raises:
        InputError: If the grid or the output cannot be used; nothing is written then.
    """
    from bimvox.exporters.grid import part_bodies, surface_bytes
    from bimvox.exporters.vti import write_vti
    from bimvox.grid.storage import read_grid

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
    if wanted.name == "vti":
        progress.stage("write")
        write_atomically(target, lambda stream: write_vti(grid, stream, threads=_THREADS), inputs=[source])
    else:
        progress.stage("faces")
        bodies = part_bodies(grid)
        if not bodies:
            raise InputError(f"{source}: all cells are air, there are no faces", hint="--to vti writes the cells")
        document["triangles"] = sum(len(body.mesh.faces) for body in bodies)
        progress.stage("write")
        write_atomically(target, surface_bytes(grid, bodies, wanted.name), inputs=[source])
    progress.finish()
    return {**document, "seconds": progress.seconds}
