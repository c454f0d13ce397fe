"""The geometry processes. A kernel may hang or crash on a real file, so it runs in its own process.

``process`` runs this as ``python -m bimvox.bim.ifc.worker NUMBER FILE``; the number is that of its connection. This
process loads the file. Where processes can be forked it then is the server of ``forks`` and never meshes anything.
Elsewhere it is a worker, and every further worker loads the file again. If its parent ends, it ends too.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

import ifcopenshell.geom
import numpy as np
from numpy.typing import NDArray

from bimvox.bim.ifc.answer import READY, Answer, Selected, answer_requests, clean_shape
from bimvox.bim.ifc.open import parse_text
from bimvox.bim.ifc.step_file import step_bytes
from bimvox.bim.ifc.text import parser_text
from bimvox.errors import SelectionError
from bimvox.files import read_input
from bimvox.processes import CAN_FORK, connection_of

CIRCLE_SEGMENTS = 64
"""Edges of a full circle in the fast library. Its default of 16 would cut 1 cm off a column of 1 m; 64 cut 0.6 mm,
less than the 1 mm tolerance of the plain library."""


class _Kernel:
    """The meshers of one file: one reusable kernel for each library.

    Args:
        file: The ``ifcopenshell.file``.
    """

    def __init__(self, file: Any) -> None:
        self._file = file
        self._settings = geometry_settings()
        self._kernels: dict[str, Any] = {}

    def mesh(self, step_ids: tuple[int, ...], library: str) -> Answer:
        """Return the mesh of the first product and the placements of all.

        Args:
            step_ids: Products with a representation that share their shape.
            library: Name of the geometry library.

        Returns:
            The shape and the placements, or the reason why there is no shape.
        """
        if library not in self._kernels:
            self._kernels[library] = ifcopenshell.geom.kernel(self._settings, self._file, geometry_library=library)
        products = [self._file.by_id(step_id) for step_id in step_ids]
        try:
            shape = self._kernels[library].create_shape(products[0])
            placements = [np.array(shape.transformation.matrix, dtype=np.float64).reshape(4, 4).T]
            placements += [self._placement(product) for product in products[1:]]
        except RuntimeError as error:
            return f"no geometry ({_first_words(str(error)) or 'the kernel says nothing'})"
        faces = np.array(shape.geometry.faces, dtype=np.int32).reshape(-1, 3)
        vertices = np.array(shape.geometry.verts, dtype=np.float64).reshape(-1, 3)
        clean = clean_shape(vertices, faces)
        return clean if isinstance(clean, str) else (clean, placements)

    def select(self, query: str) -> Selected:
        """Return the step ids of the products that a query matches, or the error about the query."""
        from bimvox.bim.ifc.select import select_products  # the selector takes half a second to import

        try:
            return select_products(self._file, query)
        except SelectionError as error:
            return error

    def _placement(self, product: Any) -> NDArray[np.float64]:
        """Return the (4, 4) placement of a product in metres, as the kernel sees it."""
        if product.ObjectPlacement is None:
            return np.eye(4)
        mapped = ifcopenshell.geom.map_shape(self._settings, product.ObjectPlacement)
        return np.array(mapped.components, dtype=np.float64)


def _first_words(said: str) -> str:
    """Return what the kernel says without the product, which would give every product a note of its own."""
    return said.partition("Product:")[0].partition("\n")[0].strip(" .:")


def geometry_settings() -> Any:
    """Return the kernel's settings: local coordinates (they stay precise at far placements), shells reoriented."""
    settings = ifcopenshell.geom.settings()
    settings.set("reorient-shells", True)
    settings.set("weld-vertices", True)
    settings.set("no-normals", True)
    settings.set("circle-segments", CIRCLE_SEGMENTS)
    return settings


def _kernel_of(path: Path) -> _Kernel:
    return _Kernel(parse_text(path, parser_text(path, step_bytes(path, read_input(path)))[0]))


def main() -> None:
    """Load the file, then fork workers; where nothing can be forked, be the only worker of this process."""
    control = connection_of(int(sys.argv[1]))
    path = Path(sys.argv[2])
    if sys.platform != "win32" and CAN_FORK:
        from bimvox.bim.ifc.forks import leave_no_core_file, serve

        leave_no_core_file()
        kernel = _kernel_of(path)
        serve(control, kernel.mesh, kernel.select)
    else:
        kernel = _kernel_of(path)
        control.send(READY)
        answer_requests(control, kernel.mesh, kernel.select)
    os._exit(0)  # freeing a large file instance by instance would take seconds


if __name__ == "__main__":
    main()
