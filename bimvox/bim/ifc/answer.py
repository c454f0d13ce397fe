"""What the geometry workers and their parent say to each other: clean shapes, within a limit of processor time."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Hashable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh
from bimvox.bim.mesh.repair import Solid, drop_bad_faces, solid_of, turn_outward
from bimvox.errors import SelectionError


@dataclass(frozen=True, slots=True, eq=False)
class Shape:
    """Clean triangles in the own frame of the products that share them.

    Attributes:
        mesh: Metres; faces look outward, all vertices are used.
        solid: What it encloses.
        dropped: Triangles without area that were dropped.
        turned: Whether faces had to be turned outward.
    """

    mesh: TriangleMesh
    solid: Solid
    dropped: int
    turned: bool


@dataclass(frozen=True, slots=True, eq=False)
class PlacedShape:
    """The shape of one product, and its placement.

    Attributes:
        shape: Clean triangles in the product's own frame; products may share one.
        placement: (4, 4) float64, product to world, metres.
    """

    shape: Shape
    placement: NDArray[np.float64]

    def mesh(self, origin_m: NDArray[np.float64]) -> TriangleMesh:
        """Return the mesh relative to a world point; subtracted first, so that a far placement costs no precision."""
        shift: NDArray[np.float64] = self.placement[:3, 3] - origin_m
        own = self.shape.mesh
        return TriangleMesh(own.vertices_m @ self.placement[:3, :3].T + shift, own.faces)


def clean_shape(vertices_m: NDArray[np.float64], faces: NDArray[np.int32]) -> Shape | str:
    """Return a kernel's triangles, repaired and measured; or the reason why they are not a shape.

    Args:
        vertices_m: (V, 3).
        faces: (F, 3).
    """
    if not len(faces):
        return "no triangles"
    mesh, dropped = drop_bad_faces(TriangleMesh(vertices_m, faces))
    if not len(mesh.faces):
        return "its triangles have no area"
    mesh, shells, turned = turn_outward(mesh)
    solid = solid_of(shells)
    used, index = np.unique(mesh.faces, return_inverse=True)
    mesh = TriangleMesh(mesh.vertices_m[used], index.reshape(-1, 3).astype(np.int32))
    return Shape(mesh, solid, dropped, turned)


def shape_groups(file: Any, step_ids: Sequence[int]) -> list[tuple[int, ...]]:
    """Return groups of products whose shapes are equal in their own frames: they consist of the same instances.

    Products share a shape if all their representations contain the same items, or map the same representations in the
    same way, and if nothing is cut out of any of them.

    Args:
        file: The ``ifcopenshell.file``.
        step_ids: Products with a representation.

    Returns:
        Tuples of step ids, each in the given order, sorted by the position of their first; together all step ids.
    """
    alike: dict[Hashable, list[int]] = {}
    for step_id in step_ids:
        alike.setdefault(_shape_key(file.by_id(step_id)), []).append(step_id)
    groups: list[tuple[int, ...]] = []
    for members in alike.values():
        if len(members) == 1:
            groups.append((members[0],))
            continue
        cut = {step_id for step_id in members if _is_cut(file.by_id(step_id))}
        groups += [(step_id,) for step_id in cut]
        groups += [tuple(step_id for step_id in members if step_id not in cut)] if len(cut) < len(members) else []
    place = {step_id: index for index, step_id in enumerate(step_ids)}
    return sorted(groups, key=lambda group: place[group[0]])


def _shape_key(product: Any) -> Hashable:
    """Return what determines its shape; the class is included, since it affects which representation a kernel uses."""
    content = []
    for representation in product.Representation.Representations:
        items = tuple(_item_key(item) for item in representation.Items)
        context = representation.ContextOfItems
        content.append((context.id() if context else 0, representation.RepresentationIdentifier, items))
    return product.is_a(), tuple(content)


def _item_key(item: Any) -> Hashable:
    if not item.is_a("IfcMappedItem"):
        return int(item.id())
    return int(item.MappingSource.id()), _values(item.MappingTarget)


def _values(value: Any) -> Hashable:
    """Return an instance as its class and plain values: exporters write equal transformations many times."""
    if hasattr(value, "is_a"):
        return value.is_a(), tuple(_values(attribute) for attribute in value)
    return tuple(_values(part) for part in value) if isinstance(value, tuple) else str(value)


def _is_cut(product: Any) -> bool:
    """Return whether openings are cut out of a product: its own, or those of the wholes that it is a part of."""
    seen: set[int] = set()
    whole: Any | None = product
    while whole is not None and whole.id() not in seen:
        seen.add(whole.id())
        if getattr(whole, "HasOpenings", ()):
            return True
        above = getattr(whole, "Decomposes", ()) or ()
        whole = above[0].RelatingObject if above and hasattr(above[0], "RelatingObject") else None
    return False


# A limit of the processor time that a geometry worker spends on one request.
#
# Elapsed time would lose other parts on a busy machine than on an idle one, so that one model gave two plans.

_NO_LIMIT_S = 1e8


@contextmanager
def _processor_time_limit(limit_s: float) -> Iterator[None]:
    """Let the system end this process if the body takes more than ``limit_s`` seconds of its processor time.

    The system ends it inside a library too, where Python would not come to look at a clock.
    """
    _set_limit(limit_s)
    try:
        yield
    finally:
        _set_limit(None)


if sys.platform == "win32":
    import ctypes
    from ctypes import wintypes
    from functools import cache

    OUT_OF_TIME = 1816
    """Exit status of a process that the system has ended at its limit: ERROR_NOT_ENOUGH_QUOTA."""

    class _BasicLimits(ctypes.Structure):
        """``JOBOBJECT_BASIC_LIMIT_INFORMATION``; times in units of 100 ns."""

        _fields_ = (
            ("PerProcessUserTimeLimit", ctypes.c_int64),
            ("PerJobUserTimeLimit", ctypes.c_int64),
            ("LimitFlags", wintypes.DWORD),
            ("MinimumWorkingSetSize", ctypes.c_size_t),
            ("MaximumWorkingSetSize", ctypes.c_size_t),
            ("ActiveProcessLimit", wintypes.DWORD),
            ("Affinity", ctypes.c_size_t),
            ("PriorityClass", wintypes.DWORD),
            ("SchedulingClass", wintypes.DWORD),
        )

    _BASIC_LIMITS, _PROCESS_TIME = 2, 0x2

    @cache
    def _job() -> tuple[Any, Any]:
        """Return the system's library and a job that holds this process alone."""
        kernel32 = ctypes.WinDLL("kernel32")
        kernel32.CreateJobObjectW.restype = wintypes.HANDLE
        kernel32.GetCurrentProcess.restype = wintypes.HANDLE
        job = wintypes.HANDLE(kernel32.CreateJobObjectW(None, None))
        kernel32.AssignProcessToJobObject(job, wintypes.HANDLE(kernel32.GetCurrentProcess()))
        return kernel32, job

    def _set_limit(limit_s: float | None) -> None:
        """Limit what this process takes from now on. A system that refuses leaves the limit of elapsed time."""
        kernel32, job = _job()
        until_s = os.times().user + (_NO_LIMIT_S if limit_s is None else limit_s)
        limits = _BasicLimits(PerProcessUserTimeLimit=int(until_s * 1e7), LimitFlags=_PROCESS_TIME)
        kernel32.SetInformationJobObject(job, _BASIC_LIMITS, ctypes.byref(limits), ctypes.sizeof(limits))

else:
    import signal

    OUT_OF_TIME = -signal.SIGPROF
    """Exit status of a process that the system has ended at its limit."""

    def _set_limit(limit_s: float | None) -> None:
        """Start or stop the timer that ends this process; a signal without a handler needs no Python."""
        if hasattr(signal, "setitimer"):  # otherwise the limit of elapsed time is left
            signal.setitimer(signal.ITIMER_PROF, limit_s or 0.0)


READY = "ready"
"""The first message: the file is loaded."""
Answer = tuple[Shape, list[NDArray[np.float64]]] | str
"""A shape and the placement of each product, (4, 4) float64, metres; or the reason why there is no shape."""
Selected = frozenset[int] | SelectionError
"""Step ids, or the error about the query."""
Selector = Callable[[str], Selected]
"""Finds the products that a query matches."""
Mesher = Callable[[tuple[int, ...], str], Answer]
"""Meshes products that share one shape, with the named library."""


def no_selector(query: str) -> Selected:
    """Refuse queries, in a worker that gets none."""
    raise NotImplementedError(query)


def answer_requests(channel: Connection, mesher: Mesher, selector: Selector = no_selector) -> None:
    """Answer requests until the parent closes the connection: a query or (step ids, library), each with its limit.

    The limit is in seconds of processor time; the process ends there.
    """
    with suppress(EOFError, OSError):
        while True:
            request, limit_s = channel.recv()
            with _processor_time_limit(limit_s):
                answer = selector(request) if isinstance(request, str) else mesher(*request)
            channel.send(answer)
