"""Read a mesh file into a building: named things become elements, a lump without names is cut into its bodies.

STL, OBJ, PLY and OFF say nothing about their unit, glTF is in metres with y up, 3MF states its unit.
"""

from __future__ import annotations

import fnmatch
import io
import json
import logging
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.bodies import bodies_of
from bimvox.bim.building import Building, Element, Role, SkippedProduct, Source, TriangleMesh
from bimvox.bim.densities import DEFAULT_DENSITY_KG_M3
from bimvox.bim.local_origin import FAR_M, local_origin
from bimvox.bim.mesh_repair import drop_bad_faces, solid_volume_m3, turn_outward, weld
from bimvox.bim.name_roles import role_by_name
from bimvox.bim.options import Progress, ReadOptions
from bimvox.errors import MeshError, SelectionError
from bimvox.units import METRES_PER_UNIT, metres_per

MESH_CLASS = "Mesh"
_Y_UP = (".glb", ".gltf")
_3MF_UNITS = {"millimeter": "mm", "centimeter": "cm", "inch": "in", "foot": "ft", "meter": "m", "micron": "µm"}
_METRES = {**METRES_PER_UNIT, "µm": 1e-6}
_Y_UP_TO_Z_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])


def read_mesh_file(path: Path, data: bytes, sha256: str, options: ReadOptions, report: Progress) -> Building:
    """Read a mesh file.

    Every element is a component, but for names that say terrain or an obstacle (``name_roles``); with a selection, the
    names it matches are components and the others structure.

    Args:
        path: Its suffix says the format.
        data: Its bytes.
        sha256: Their hash.
        options: ``select``: names with wildcards, separated by commas; ``unit``: the file's unit.
        report: Told about progress.

    Raises:
        MeshError: If the file cannot be read or holds no triangles.
        SelectionError: If a name of the selection matches nothing.
        InputError: If the unit is unknown.
    """
    suffix = path.suffix.lower()
    report("open", 0, 1)
    named, stated_unit = _load(path, data)
    report("open", 1, 1)
    notes: list[str] = []
    unit, metres, assumed = _unit(suffix, stated_unit, options.unit, notes)

    meshes: dict[str, TriangleMesh] = {}
    skipped: list[SkippedProduct] = []
    dropped = 0
    for name, mesh in sorted(named.items(), key=lambda item: _natural(item[0])):
        clean, bad = drop_bad_faces(TriangleMesh(mesh.vertices_m * metres, mesh.faces))
        dropped += bad
        if len(clean.faces):
            clean, bad = drop_bad_faces(weld(clean))
            dropped += bad
        if not len(clean.faces):
            skipped.append(SkippedProduct(name, MESH_CLASS, name, "has no triangle with an area"))
            continue
        if name:
            meshes[name] = clean
        else:
            meshes |= {f"body-{index}": body for index, body in enumerate(bodies_of(clean))}
    if not meshes:
        raise MeshError(path, "holds no triangle with an area", hint="export it as a triangle mesh")
    if dropped:
        notes.append(f"triangles without area, or with a corner that is no number, dropped: {dropped}")
    origin_m = local_origin([mesh.bounds_m for mesh in meshes.values()])
    span_m = max(float(np.ptp(mesh.bounds_m, axis=0).max()) for mesh in meshes.values())
    if assumed and span_m > FAR_M:
        notes.append(f"in metres it spans {span_m:,.0f} m: the unit is most likely mm")
    roles = _roles(path, list(meshes), options.select)
    elements = []
    flipped, guessed = 0, []
    for index, (name, mesh) in enumerate(meshes.items()):
        local = TriangleMesh(mesh.vertices_m - origin_m, mesh.faces)
        outward, shells, turned = turn_outward(local)
        volume_m3, exact = solid_volume_m3(outward, shells)
        flipped += turned
        guessed += [] if exact else [name]
        kg = volume_m3 * DEFAULT_DENSITY_KG_M3
        elements.append(Element(name, name, MESH_CLASS, name, outward, roles[name], kg, "default"))
        report("elements", index + 1, len(meshes))
    if flipped:
        notes.append(f"inside-out bodies turned outward: {flipped}")
    if guessed:
        notes.append(f"bodies that are not closed, whose mass is a guess: {_some(guessed)}")
    source = Source(path.name, sha256, suffix[1:].upper(), unit, assumed)
    return Building(tuple(elements), tuple(skipped), source, origin_m, notes=tuple(notes))


def _load(path: Path, data: bytes) -> tuple[dict[str, TriangleMesh], str | None]:
    """Return the meshes by name, in file units and z up, and the unit that the file states.

    A single mesh that the file gives no name has the name "".
    """
    import trimesh

    suffix = path.suffix.lower()
    logging.getLogger("trimesh").addHandler(logging.NullHandler())
    try:
        if suffix == ".gltf":
            json.loads(data)  # trimesh takes what is no JSON for the name of a file
        scene = trimesh.load_scene(
            io.BytesIO(_as_utf8(suffix, data)),
            file_type=suffix[1:],
            resolver=trimesh.resolvers.FilePathResolver(str(path)) if suffix in (".gltf", ".obj") else None,
            process=False,
            **_loader_options(suffix),
        )
        placed = {str(node): _placed(scene, node) for node in sorted(scene.graph.nodes_geometry)}
    except Exception as error:  # the loaders of six foreign formats raise anything, from KeyError to struct.error
        what = str(error).split("\n")[0] or type(error).__name__
        raise MeshError(
            path, f"cannot be read as {suffix[1:].upper()}: {what}", hint="export it again, or check the suffix"
        ) from error
    found = {name: mesh for name, mesh in placed.items() if mesh is not None}
    if suffix in _Y_UP:
        found = {
            name: TriangleMesh(mesh.vertices_m @ _Y_UP_TO_Z_UP.T + 0.0, mesh.faces) for name, mesh in found.items()
        }
    if len(found) == 1 and not _is_named(suffix, path, next(iter(found))):
        found = {"": next(iter(found.values()))}
    return found, _3mf_unit(path, scene) if suffix == ".3mf" else None


def _3mf_unit(path: Path, scene: Any) -> str:
    """Return the unit of a 3MF file; millimetres where it leaves that out, by its standard."""
    stated = next((str(mesh.metadata["units"]) for mesh in scene.geometry.values() if "units" in mesh.metadata), "")
    name = stated.lower().removesuffix("s") or "millimeter"
    if name not in _3MF_UNITS:
        raise MeshError(path, f"states the unit {stated!r}, which 3MF does not know", hint="export it again")
    return _3MF_UNITS[name]


def _as_utf8(suffix: str, data: bytes) -> bytes:
    """Re-encode text that is not UTF-8 (names in Latin-1), which the loaders refuse; binary STL is left alone."""
    is_binary_stl = (
        suffix == ".stl" and len(data) >= 84 and len(data) == 84 + 50 * int.from_bytes(data[80:84], "little")
    )
    if suffix not in (".stl", ".obj", ".off") or is_binary_stl:
        return data
    try:
        data.decode()
    except UnicodeDecodeError:
        return data.decode("latin-1").encode()
    return data


def _loader_options(suffix: str) -> dict[str, Any]:
    """Return what trimesh needs to keep names apart."""
    if suffix == ".obj":
        return {"split_objects": True, "split_groups": True, "group_material": False, "skip_materials": True}
    # Several primitives of one node would otherwise get random names.
    return {"merge_primitives": True} if suffix in _Y_UP else {}


def _placed(scene: Any, node: str) -> TriangleMesh | None:
    """Return the triangles of one node in the file's world, None for points and curves."""
    matrix, name = scene.graph[node]
    geometry = scene.geometry[name]
    faces = np.asarray(getattr(geometry, "faces", ()), dtype=np.int32).reshape(-1, 3)
    if not len(faces):
        return None
    vertices: NDArray[np.float64] = np.asarray(geometry.vertices, dtype=np.float64)
    if not np.array_equal(matrix, np.eye(4)):
        vertices = vertices @ matrix[:3, :3].T + matrix[:3, 3]
        if np.linalg.det(matrix[:3, :3]) < 0:
            faces = np.ascontiguousarray(faces[:, ::-1])
    return TriangleMesh(vertices, faces)


def _is_named(suffix: str, path: Path, node: str) -> bool:
    """Say whether the file itself gives its only mesh a name (a lone STL solid is a lump with a title)."""
    if suffix in (".stl", ".ply", ".off"):
        return False
    return suffix != ".obj" or node not in (path.name, "geometry")


def _unit(suffix: str, stated: str | None, asked: str | None, notes: list[str]) -> tuple[str, float, bool]:
    """Return the unit's name, what it is in metres, and whether it is assumed."""
    if asked is not None:
        metres = metres_per(asked)
        known = stated or ("m" if suffix in _Y_UP else None)
        if known not in (None, asked):
            notes.append(f"read in {asked} as asked, although the file is in {known}")
        return asked, metres, False
    if stated is not None:
        return stated, _METRES[stated], False
    if suffix in _Y_UP:
        return "m", 1.0, False
    notes.append("the file states no unit: metres are assumed")
    return "m", 1.0, True


def _roles(path: Path, names: Sequence[str], select: str | None) -> Mapping[str, Role]:
    """Return the role of every name."""
    by_name = {name: role_by_name(name) for name in names}
    if select is None:
        return {name: role or Role.COMPONENT for name, role in by_name.items()}
    patterns = [pattern.strip() for pattern in select.split(",") if pattern.strip()]
    chosen: set[str] = set()
    for pattern in patterns:
        matching = fnmatch.filter(names, pattern)
        if not matching:
            raise SelectionError(
                f"select {select!r}: no body of {path.name} is named {pattern!r}",
                hint=f"the file has {_some(names)}; * and ? are wildcards",
            )
        chosen.update(matching)
    if not chosen:
        raise SelectionError(f"select {select!r}: names nothing", hint=f"the file has {_some(names)}")
    rest = {name: Role.GROUND if role is Role.GROUND else Role.STRUCTURE for name, role in by_name.items()}
    return {name: Role.COMPONENT if name in chosen else rest[name] for name in names}


def _natural(name: str) -> tuple[tuple[int, str], ...]:
    """Sort key that puts ``body-2`` before ``body-10``."""
    return tuple((int(digits or -1), text) for digits, text in re.findall(r"(\d*)(\D*)", name))


def _some(names: Sequence[str], most: int = 8) -> str:
    """List names, not all of very many."""
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more
