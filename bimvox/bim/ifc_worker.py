"""The geometry worker: a process of its own, because a geometry kernel may hang or crash on a real file.

Run by ``ifc_geometry`` as ``python -m bimvox.bim.ifc_worker FILE``. It answers on its standard output, one pickled
message each: first ``"ready"``, then for every (step id, library) that it is sent (vertices, faces, placement), or a
sentence that says why there is none.
"""

from __future__ import annotations

import os
import sys
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import ifcopenshell.geom
import numpy as np
from numpy.typing import NDArray

from bimvox.bim.ifc_open import parse_step
from bimvox.bim.step_file import step_bytes

Triangles = tuple[NDArray[np.float64], NDArray[np.int32], NDArray[np.float64]]


def geometry_settings() -> Any:
    """Return the kernel's settings: local coordinates (their precision survives far placements), shells reoriented."""
    settings = ifcopenshell.geom.settings()
    settings.set("reorient-shells", True)
    settings.set("weld-vertices", True)
    settings.set("no-normals", True)
    return settings


def triangles_of(settings: Any, product: Any, library: str) -> Triangles | str:
    """Mesh one product.

    Args:
        settings: From ``geometry_settings``.
        product: An ``IfcProduct`` with a representation.
        library: Name of the geometry library.

    Returns:
        Vertices (V, 3) float64 in metres in the product's own frame, faces (F, 3) int32, placement (4, 4) float64; or
        the reason why there is none.
    """
    try:
        shape = ifcopenshell.geom.create_shape(settings, product, geometry_library=library)
    except RuntimeError as error:
        return f"no geometry ({str(error).strip() or 'the kernel says nothing'})"
    faces = np.array(shape.geometry.faces, dtype=np.int32).reshape(-1, 3)
    if not len(faces):
        return "no triangles"
    vertices = np.array(shape.geometry.verts, dtype=np.float64).reshape(-1, 3)
    placement = np.array(shape.transformation.matrix, dtype=np.float64).reshape(4, 4).T
    return vertices, faces, placement


def main() -> None:
    """Serve requests until the parent closes the pipe."""
    answers = Connection(os.dup(1), readable=False)
    os.dup2(2, 1)  # what a kernel prints must not land among the answers
    requests = Connection(os.dup(0), writable=False)
    path = Path(sys.argv[1])
    file = parse_step(path, step_bytes(path, path.read_bytes()))
    settings = geometry_settings()
    answers.send("ready")
    while True:
        try:
            step_id, library = requests.recv()
        except EOFError:
            return
        answers.send(triangles_of(settings, file.by_id(step_id), library))


if __name__ == "__main__":
    main()
