"""A site as one file inside the log, complete enough to prove the log from the log alone.

A zip of ``site.json`` and one flat ``<dtype>.npy`` for each dtype; the JSON refers into them (see ``codec``). Labels,
blockers, shapes, meshes (float64, exactly), crane, rules, yard, transforms and digests: everything a ``Site`` holds.
"""

from __future__ import annotations

import io
import json
import struct
import zipfile
import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh
from bimvox.errors import LogFileError
from bimvox.grid.frame import Label
from bimvox.grid.layout import BROKEN_ZIP
from bimvox.log.codec import DTYPES, ArrayReader, ArrayWriter, DecodeError, decode, encode
from bimvox.log.mcap.form import Encoded, json_text
from bimvox.site.component import Shape
from bimvox.site.site import Site
from bimvox.sparse import names_to_write

_FORMAT = "bimvox-site"
_VERSION = 1
_MAX_HEADER = 10_000


def site_to_bytes(site: Site) -> bytes:
    """Return a site as a compressed bundle; deterministic."""
    return _to_bytes(site, {})


class SiteWriter:
    """Encodes a series of sites that share most of their values, such as a watched site with changing obstructions.

    Args:
        site: The first site. Values that another site shares with it, as the same object, are encoded only once.
    """

    def __init__(self, site: Site) -> None:
        self._known = {name: (value, Encoded(value)) for name, value in _values_of(site).items()}

    def to_bytes(self, site: Site) -> bytes:
        """Return the same bytes as :func:`site_to_bytes`."""
        values = _values_of(site)
        same = {name: encoded for name, (value, encoded) in self._known.items() if values.get(name) is value}
        return _to_bytes(site, same)


def _to_bytes(site: Site, known: Mapping[str, Encoded]) -> bytes:
    arrays = ArrayWriter()
    values = ",".join(
        f"{json_text(name)}:{known[name].text(arrays) if name in known else json_text(encode(value, arrays))}"
        for name, value in _values_of(site).items()
    )
    text = f'{{"format":{json_text(_FORMAT)},"version":{_VERSION},"site":{{{values}}}}}'
    members = {"site.json": text.encode()}
    members |= {f"{dtype}.npy": to_npy(flat) for dtype, flat in arrays.flat().items()}
    return pack(members)


def _values_of(site: Site) -> dict[str, Any]:
    """The fields of a site by the names that they have in a bundle: of ``cranes`` the first, and the others if any."""
    values: dict[str, Any] = {}
    for name in names_to_write(site):
        if name == "cranes":
            values["crane"] = next(iter(site.cranes), None)
        else:
            values[name] = getattr(site, name)
    return {**values, "other_cranes": site.cranes[1:]} if len(site.cranes) > 1 else values


def _with_cranes(values: Any) -> Any:
    """Undo what ``_values_of`` does to the cranes."""
    if not isinstance(values, dict) or "crane" not in values or "cranes" in values:
        raise DecodeError("site: not a table with a 'crane'")
    first, others = values["crane"], values.get("other_cranes", [])
    if not isinstance(others, list):
        raise DecodeError("site.other_cranes: not a list")
    rest = {name: value for name, value in values.items() if name not in ("crane", "other_cranes")}
    return {**rest, "cranes": [] if first is None else [first, *others]}


def site_from_bytes(data: bytes, name: str) -> Site:
    """Return the site of a bundle.

    ``name``: its source, for messages.

    Raises:
        LogFileError: If the bundle is damaged, hostile or inconsistent.
    """
    try:
        return _read(unpack(data))
    except (ValueError, RecursionError) as error:
        raise LogFileError(name, f"the site in it cannot be read: {error}") from error


def _read(members: dict[str, bytes]) -> Site:
    if "site.json" not in members:
        raise _ArchiveError("it has no site.json")
    flat = {dtype: from_npy(members[f"{dtype}.npy"], dtype) for dtype in DTYPES if f"{dtype}.npy" in members}
    document = json.loads(members["site.json"])
    if not isinstance(document, dict) or document.get("format") != _FORMAT:
        raise _ArchiveError("it is not a site")
    if document.get("version") != _VERSION:
        raise _ArchiveError(f"its version {document.get('version')!r} is not {_VERSION}; use the bimvox that wrote it")
    site: Site = decode(Site, _with_cranes(document.get("site")), ArrayReader(flat), "site")
    _check(site)
    return site


def to_npy(flat: NDArray[Any]) -> bytes:
    """Return a flat array as a .npy, little-endian."""
    buffer = io.BytesIO()
    little = flat.astype(flat.dtype.newbyteorder("<"), copy=False)
    np.lib.format.write_array(buffer, little, version=(1, 0), allow_pickle=False)
    return buffer.getvalue()


def from_npy(data: bytes, dtype: str) -> NDArray[Any]:
    """Return the flat array of a .npy; its size is checked against the data before anything is allocated."""
    stream = io.BytesIO(data)
    try:
        if np.lib.format.read_magic(stream) != (1, 0):
            raise _ArchiveError(f"{dtype}.npy has an unknown version")
        shape, _, found = np.lib.format.read_array_header_1_0(stream, max_header_size=_MAX_HEADER)
    except ValueError as error:
        raise _ArchiveError(f"{dtype}.npy: {error}") from error
    body = memoryview(data)[stream.tell() :]
    if found.name != dtype or len(shape) != 1 or shape[0] * found.itemsize != len(body):
        raise _ArchiveError(f"{dtype}.npy does not hold what its header says")
    return np.frombuffer(body, dtype=found)


def _check(site: Site) -> None:
    """Raise DecodeError if the values of a site are inconsistent, because later code indexes with them."""
    if site.labels.ndim != 3 or 0 in site.labels.shape:
        raise DecodeError("site.labels: not a grid")
    if int(site.labels.max()) > max(Label):
        raise DecodeError("site.labels: unknown label")
    if site.yard.shape != site.labels.shape[:2] or site.site_to_ifc.shape != (4, 4):
        raise DecodeError("site.yard or site.site_to_ifc: wrong shape")
    for name in ("access", "natural_ground_m"):
        if (columns := getattr(site, name)) is not None and columns.shape != site.yard.shape:
            raise DecodeError(f"site.{name}: wrong shape")
    if site.moving is not None and len(site.moving.names) != len(site.cranes):
        raise DecodeError("site.moving: not as many set-ups as places of the crane")
    if not site.frame.voxel_size_m > 0:
        raise DecodeError("site.frame.voxel_size_m: not positive")
    for n, blocker in enumerate(site.blockers):
        _check_cells(blocker.cells, site.shape, f"site.blockers[{n}].cells")
        if blocker.mesh is not None:
            _check_mesh(blocker.mesh, f"site.blockers[{n}].mesh", blocker.id)
    for n, component in enumerate(site.components):
        where = f"site.components[{n}]"
        if component.index != n:
            raise DecodeError(f"{where}.index: {component.index} instead of {n}")
        _check_cells(component.shape.cells, site.shape, f"{where}.shape.cells")
        _check_boxes(component.shape, f"{where}.shape.boxes")
        _check_mesh(component.mesh, f"{where}.mesh", component.label)
        if component.crane and not 0 <= component.crane < len(site.cranes):
            raise DecodeError(f"{where}.crane: the site has no crane {component.crane}")
        if component.tandem is not None and not 0 <= component.tandem.second < len(site.cranes):
            raise DecodeError(f"{where}.tandem: the site has no crane {component.tandem.second}")
        high = np.add(component.target_vox, component.shape.size_vox)
        if min(component.target_vox) < 0 or (high > site.shape).any():
            raise DecodeError(f"{where}.target_vox: outside the grid")


def _check_cells(cells: NDArray[np.int32], shape: tuple[int, int, int], where: str) -> None:
    if (
        cells.ndim != 2
        or cells.shape[1] != 3
        or (cells.size and (cells.min() < 0 or (cells.max(axis=0) >= shape).any()))
    ):
        raise DecodeError(f"{where}: not cells of the grid")


def _check_mesh(mesh: TriangleMesh, where: str, name: str) -> None:
    if mesh.vertices_m.ndim != 2 or mesh.vertices_m.shape[1] != 3 or mesh.faces.ndim != 2 or mesh.faces.shape[1] != 3:
        raise DecodeError(f"{where}: not triangles")
    if mesh.faces.size and (mesh.faces.min() < 0 or mesh.faces.max() >= len(mesh.vertices_m)):
        raise DecodeError(f"{where}: a face refers to a missing vertex")
    if not len(mesh.faces):
        raise DecodeError(f"{where}: {name} has no faces")


def _check_boxes(shape: Shape, where: str) -> None:
    """Raise DecodeError unless the boxes are disjoint and their union is the cells."""
    if not shape.cells.size or shape.boxes.ndim != 2 or shape.boxes.shape[1] != 6:
        raise DecodeError(f"{where}: not boxes")
    dense = np.zeros(shape.cells.max(axis=0) + 1, np.int32)
    dense[tuple(shape.cells.T)] = 1
    if (shape.boxes < 0).any() or (shape.boxes[:, 3:].max(axis=0) != dense.shape).any():
        raise DecodeError(f"{where}: they do not fit the cells")
    for x0, y0, z0, x1, y1, z1 in shape.boxes.tolist():
        dense[x0:x1, y0:y1, z0:z1] -= 1
    if dense.any():
        raise DecodeError(f"{where}: their union is not the cells")


# A deterministic zip of named byte strings, read without trusting its claims.

_TIMESTAMP = (1980, 1, 1, 0, 0, 0)  # the earliest that zip can store: no wall-clock time in the bytes
_UNIX = 3
_MODE = 0o644 << 16
_ZIP_VERSION = zipfile.DEFAULT_VERSION
_SAME_FIELDS = struct.pack("<4H", 0, zipfile.ZIP_DEFLATED, 0, 1 << 5 | 1)
"""What the two headers of every member have alike: no flags, the method, the timestamp."""
_SIZES = struct.Struct("<3L2H")
"""Checksum, sizes, length of the name and of further fields."""
_LEVEL = 1
"""Speed over size, because a watch writes a site into every revision: a third of the time, 1.6 times the size."""
_MAX_RATIO = 1_040  # deflate reaches 1032 : 1 at most, so a larger claim is false
_MAX_BYTES = 1 << 30


class _ArchiveError(ValueError):
    """The bytes are not a sound archive; the message says why."""


def pack(members: Mapping[str, bytes]) -> bytes:
    """Return a deflated zip of ``members``, in their order."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name, data in members.items():
            info = zipfile.ZipInfo(name, _TIMESTAMP)
            info.create_system = _UNIX
            info.external_attr = _MODE
            info.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(info, data, compresslevel=_LEVEL)
    return buffer.getvalue()


def unpack(data: bytes) -> dict[str, bytes]:
    """Return the members of an archive made by :func:`pack`; sizes are checked before reading, checksums after.

    Raises:
        ArchiveError: If the bytes are damaged, claim impossible sizes, or are not a zip.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            _check_claims(archive.infolist())
            return {info.filename: archive.read(info) for info in archive.infolist()}
    except _ArchiveError:
        raise
    except BROKEN_ZIP as error:
        raise _ArchiveError(f"it is damaged or not an archive ({error})") from error


def is_same_archive(found: bytes, wanted: bytes) -> bool:
    """Return whether an archive is one that :func:`pack` made; see :func:`is_as_packed`.

    Raises:
        ArchiveError: As :func:`unpack`.
    """
    return found == wanted or (unpack(found) == unpack(wanted) and is_as_packed(found))


def is_as_packed(data: bytes) -> bool:
    """Return whether an archive is what :func:`pack` makes of its members, byte by byte.

    Only how the members are deflated is not looked at, because other versions of zlib give other bytes: each is one
    whole stream, with nothing after it. So nothing stands before, between or after the members, which another reader
    might take for the archive.

    Raises:
        ArchiveError: As :func:`unpack`.
    """
    files, index = b"", b""
    members = unpack(data)
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        for info in archive.infolist():
            name, at = info.filename.encode(), len(files)
            sizes = _SIZES.pack(info.CRC, info.compress_size, info.file_size, len(name), 0)
            head = struct.pack("<4sH", b"PK\3\4", _ZIP_VERSION) + _SAME_FIELDS + sizes + name
            stream = data[at + len(head) : at + len(head) + info.compress_size]
            if not _is_stream_of(stream, members[info.filename]):
                return False
            files += head + stream
            index += struct.pack("<4s2BH", b"PK\1\2", _ZIP_VERSION, _UNIX, _ZIP_VERSION) + _SAME_FIELDS + sizes
            index += struct.pack("<3H2L", 0, 0, 0, _MODE, at) + name
    count = len(members)
    end = struct.pack("<4s4H2LH", b"PK\5\6", 0, 0, count, count, len(index), len(files), 0)
    return data == files + index + end


def _is_stream_of(stream: bytes, member: bytes) -> bool:
    inflate = zlib.decompressobj(-zlib.MAX_WBITS)
    try:
        found = inflate.decompress(stream, len(member) + 1)
    except zlib.error:
        return False
    return found == member and inflate.eof and not inflate.unused_data


def _check_claims(infos: list[zipfile.ZipInfo]) -> None:
    for info in infos:
        if info.file_size > _MAX_RATIO * info.compress_size + 1024:
            raise _ArchiveError(f"{info.filename} claims {info.file_size:,} bytes in {info.compress_size:,} compressed")
    total = sum(info.file_size for info in infos)
    if total > _MAX_BYTES:
        raise _ArchiveError(f"it claims to hold {total:,} bytes, more than the {_MAX_BYTES:,} allowed")
    if len({info.filename for info in infos}) != len(infos):
        raise _ArchiveError("it holds two members of the same name")
