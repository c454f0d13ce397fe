"""Read any building file: the suffix decides which reader opens it."""

from __future__ import annotations

import hashlib
from pathlib import Path

from bimvox.bim.building import Building
from bimvox.bim.ifc.geometry import GeometryPool
from bimvox.bim.ifc.step_file import check_frame, step_bytes
from bimvox.bim.options import MESH_SUFFIXES, ReadOptions
from bimvox.bim.strays import without_strays
from bimvox.errors import FileError, InputError
from bimvox.files import read_input
from bimvox.progress import Report

__all__ = ["IFC_SUFFIXES", "MESH_SUFFIXES", "ReadOptions", "read_building"]

IFC_SUFFIXES = (".ifc", ".ifczip")


def read_building(path: Path, options: ReadOptions | None = None, progress: Report | None = None) -> Building:
    """Return the building in an IFC or mesh file: elements with triangles in metres, z up.

    Args:
        path: The file; its suffix gives its format, case-insensitive.
        options: What to lift, units, time limits; the defaults if None.
        progress: Called with (stage, done, total).

    Raises:
        FileError: If the file is missing, empty, unreadable, truncated, malformed, or of an unknown kind.
        SelectionError: If ``options.select`` is malformed or matches nothing.
        InputError: If ``options.unit`` or ``options.up`` is unknown or contradicts the file.
    """
    path, options, report = Path(path), options or ReadOptions(), progress or (lambda stage, done, total: None)
    suffix = path.suffix.lower()
    if suffix not in IFC_SUFFIXES + MESH_SUFFIXES:
        accepted = ", ".join(IFC_SUFFIXES + MESH_SUFFIXES)
        raise FileError(path, f"{suffix or 'no suffix'}: not a building file", hint=f"accepted are {accepted}")
    data = read_input(path)
    digest = hashlib.sha256(data).hexdigest()
    if suffix in IFC_SUFFIXES:
        if options.up == "y":
            raise InputError(f"{path}: y up is requested, but IFC has z up", hint="leave up out")
        check_frame(path, step_bytes(path, data))
        # The worker imports IfcOpenShell and opens the file while this process does the same.
        with GeometryPool(path, timeout_s=options.timeout_s, processes=options.processes) as pool:
            from bimvox.bim.ifc.reader import read_ifc

            return without_strays(read_ifc(path, data, digest, options, report, pool))
    from bimvox.bim.mesh.file import read_mesh_file

    return without_strays(read_mesh_file(path, data, digest, options, report))
