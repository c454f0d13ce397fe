"""The kind of a file, by its content; the suffix decides only between formats without a signature."""

from __future__ import annotations

import json
import zipfile
from enum import StrEnum
from pathlib import Path

from bimvox.bim.options import MESH_SUFFIXES
from bimvox.errors import FileError
from bimvox.files import read_input, reason_of, require_input, status_of
from bimvox.site.nested import toml_values
from bimvox.site.obstructions.point_file import is_scan

MCAP_MAGIC = b"\x89MCAP0\r\n"
_STEP_MAGIC = b"ISO-10303-21"
_ZIP_MAGIC = b"PK"
_HEAD_BYTES = 1 << 16
_TEXT_BYTES = 64 << 20


class Kind(StrEnum):
    """Kinds of files."""

    IFC = "ifc"
    MESH = "mesh"
    GRID = "grid"
    SITE = "site"
    LOG = "log"
    OBSTRUCTIONS = "obstructions"
    POLICY = "policy"


def kind_of(path: Path) -> Kind:
    """Return the kind of a file.

    Args:
        path: Any file; a folder is a policy if it holds a manifest.

    Raises:
        FileError: If it is missing, empty, unreadable, or not of a known kind.
    """
    status_of(path)  # an impossible path is refused here
    if path.is_dir():
        if (path / POLICY_MANIFEST).is_file():
            return Kind.POLICY
        raise FileError(path, "this is a folder, but not of a policy", hint="name a file in it")
    require_input(path)
    head = _head_of(path)
    kind = _by_mark(path, head) or _by_text(path, head)
    has_points = kind is None or (kind is Kind.MESH and b"element vertex" in head)
    if has_points and is_scan(path):
        kind = Kind.OBSTRUCTIONS
    if kind is None and path.suffix.lower() in MESH_SUFFIXES:
        kind = Kind.MESH
    if kind is None:
        raise FileError(
            path,
            "no building model, grid, site file, obstruction file, log or policy is recognised in it",
            hint="bimvox reads IFC, STL, OBJ, PLY, OFF, GLB, GLTF and 3MF models, scans and its own files",
        )
    return kind


POLICY_MANIFEST = "manifest.json"


def _by_mark(path: Path, head: bytes) -> Kind | None:
    """Return the kind of a file that begins with a signature."""
    if head.startswith(MCAP_MAGIC):
        return Kind.LOG
    if head.startswith(_ZIP_MAGIC):
        return _by_members(path)
    if head.startswith((b"glTF", b"ply\n", b"ply\r", b"OFF", b"solid ")):
        return Kind.MESH
    if head.removeprefix(b"\xef\xbb\xbf").lstrip().startswith(_STEP_MAGIC) or path.suffix.lower() == ".ifc":
        return Kind.IFC
    return None


def _by_members(path: Path) -> Kind | None:
    """Return the kind of an archive, by the names in it."""
    try:
        with zipfile.ZipFile(path) as archive:
            names = archive.namelist()
    except (zipfile.BadZipFile, OSError, NotImplementedError, ValueError) as error:
        raise FileError(path, f"a damaged archive: {error}", hint="copy or write the file again") from error
    if "zarr.json" in names:
        return Kind.GRID
    if any(name.lower().endswith(".ifc") for name in names):
        return Kind.IFC
    return Kind.MESH if any(name.lower().endswith(".model") for name in names) else None


def _by_text(path: Path, head: bytes) -> Kind | None:
    """Return the kind of a TOML or JSON file, by its keys."""
    if b"\0" in head or path.stat().st_size > _TEXT_BYTES or path.suffix.lower() in set(MESH_SUFFIXES) - {".gltf"}:
        return None
    try:
        text = read_input(path).decode("utf-8-sig")
    except UnicodeDecodeError:
        return None
    keys: set[str] = set()
    try:
        values = json.loads(text)
        keys = set(values) if isinstance(values, dict) else set()
    except (ValueError, RecursionError):
        try:
            keys = set(toml_values(text))
        except (ValueError, RecursionError):
            return _broken_text(path)
    if "obstructions" in keys:
        return Kind.OBSTRUCTIONS
    if "asset" in keys:
        return Kind.MESH
    if "model" in keys:
        return Kind.SITE
    return _broken_text(path)


def _broken_text(path: Path) -> Kind | None:
    """Return the kind of a malformed text by its name; its reader then reports what is wrong, and where."""
    return {".toml": Kind.SITE, ".json": Kind.OBSTRUCTIONS}.get(path.suffix.lower())


def _head_of(path: Path) -> bytes:
    try:
        with path.open("rb") as stream:
            return stream.read(_HEAD_BYTES)
    except OSError as error:
        raise FileError(path, f"cannot be read: {reason_of(error)}") from error
