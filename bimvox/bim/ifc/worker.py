"""The geometry processes. A kernel may hang or crash on a real file, so it runs in its own process.

``process`` runs this as ``python -m bimvox.bim.ifc.worker SOCKET FILE``. This process, the server, loads the file once
and never meshes anything. It forks a worker for every socket that it receives: a worker starts in milliseconds
however large the file is, and shares its memory. If its parent ends, the server ends itself and its workers.
"""

from __future__ import annotations

import os
import resource
import signal
import sys
from collections.abc import Callable
from multiprocessing.connection import Connection
from multiprocessing.reduction import recv_handle
from pathlib import Path
from typing import Any

import ifcopenshell.geom
import numpy as np
from numpy.typing import NDArray

from bimvox.bim.ifc.open import parse_text
from bimvox.bim.ifc.shape import Shape, clean_shape
from bimvox.bim.ifc.step_file import step_bytes
from bimvox.bim.ifc.text import parser_text
from bimvox.errors import SelectionError
from bimvox.files import read_input

_SHAPE_BYTES = 4 << 30
"""Memory that a worker may allocate in addition to the file."""
CIRCLE_SEGMENTS = 64
"""Edges of a full circle in the fast library. Its default of 16 would cut 1 cm off a column of 1 m; 64 cut 0.6 mm,
less than the 1 mm tolerance of the plain library."""

Answer = tuple[Shape, list[NDArray[np.float64]]] | str
"""A shape and the placement of each product, (4, 4) float64, metres; or the reason why there is no shape."""
Selected = frozenset[int] | SelectionError
"""Step ids, or the error about the query."""
Selector = Callable[[str], Selected]
"""Finds the products that a query matches."""
Mesher = Callable[[tuple[int, ...], str], Answer]
"""Meshes products that share one shape, with the named library."""


class Kernel:
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
            return f"no geometry ({str(error).strip() or 'the kernel says nothing'})"
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


def geometry_settings() -> Any:
    """Return the kernel's settings: local coordinates (they stay precise at far placements), shells reoriented."""
    settings = ifcopenshell.geom.settings()
    settings.set("reorient-shells", True)
    settings.set("weld-vertices", True)
    settings.set("no-normals", True)
    settings.set("circle-segments", CIRCLE_SEGMENTS)
    return settings


def _no_selector(query: str) -> Selected:
    raise NotImplementedError(query)


def serve(control: Connection, mesher: Mesher, selector: Selector = _no_selector) -> None:
    """Fork workers until the parent closes the control socket.

    There are two requests. ``"fork"``, followed by a socket for the worker, returns the worker's process id. The
    process id of a worker ends that worker and returns its exit status (negative: the signal that killed it).
    """
    workers: set[int] = set()
    try:
        control.send("ready")
        while True:
            request = control.recv()
            if request == "fork":
                channel = recv_handle(control)
                pid = os.fork()
                if pid == 0:
                    control.close()
                    _work(Connection(channel), mesher, selector)
                os.close(channel)
                workers.add(pid)
                control.send(pid)
            else:
                workers.remove(request)
                os.kill(request, signal.SIGKILL)
                control.send(os.waitstatus_to_exitcode(os.waitpid(request, 0)[1]))
    except (EOFError, OSError):
        for pid in workers:
            os.kill(pid, signal.SIGKILL)
            os.waitpid(pid, 0)


def _work(channel: Connection, mesher: Mesher, selector: Selector) -> None:
    """Answer (step ids, library) requests and queries until the parent closes the socket; never returns."""
    status = 1
    _limit_memory()
    try:
        while True:
            request = channel.recv()
            channel.send(selector(request) if isinstance(request, str) else mesher(*request))
    except (EOFError, OSError):
        status = 0
    finally:
        os._exit(status)


def _limit_memory() -> None:
    """Limit the memory, so that a kernel that keeps allocating fails before the machine runs out."""
    try:
        in_use = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    except OSError:
        return  # not Linux, where such a limit would do nothing
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    limit = in_use + _SHAPE_BYTES
    resource.setrlimit(resource.RLIMIT_AS, (limit if hard == resource.RLIM_INFINITY else min(limit, hard), hard))


def main() -> None:
    """Load the file and serve."""
    control = Connection(int(sys.argv[1]))
    path = Path(sys.argv[2])
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))  # a crash leaves no file behind
    kernel = Kernel(parse_text(path, parser_text(path, step_bytes(path, read_input(path)))))
    serve(control, kernel.mesh, kernel.select)
    os._exit(0)  # freeing a large file instance by instance would take seconds


if __name__ == "__main__":
    main()
