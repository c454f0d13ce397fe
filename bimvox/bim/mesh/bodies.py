"""Split an unnamed triangle soup into the bodies that can be lifted one by one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh
from bimvox.bim.mesh.repair import Shells, shells_of
from bimvox.compiled import kernel


def bodies_of(mesh: TriangleMesh) -> list[TriangleMesh]:
    """Return the bodies of a welded mesh, in the order of their first face.

    A run of consecutive faces that is closed is its own shell, even if it shares corners with others: touching parts
    that are written one after the other stay separate. A closed shell is a body, together with its cavities (closed
    shells inside its box that face the other way). Open pieces whose boxes touch are one body: some surfaces are
    exported in patches or as loose triangles.
    """
    mesh = _apart(mesh)
    shells = shells_of(mesh)
    body_of_face = _owners(shells)[shells.of_face]
    order = np.argsort(body_of_face, kind="stable")
    _, starts = np.unique(body_of_face[order], return_index=True)
    # The owner of a body is its lowest shell, and shells are numbered by their first face.
    return [_with_own_vertices(mesh, faces) for faces in np.split(mesh.faces[order], starts[1:])]


def _apart(mesh: TriangleMesh) -> TriangleMesh:
    """Return the mesh with separate vertices for every closed run of faces."""
    count = len(mesh.faces)
    faces = mesh.faces.astype(np.int64)
    a, b = np.stack([faces, np.roll(faces, -1, axis=1)]).reshape(2, -1)
    _, edge = np.unique(np.minimum(a, b) * len(mesh.vertices_m) + np.maximum(a, b), return_inverse=True)
    order = np.argsort(edge, kind="stable")
    edge, face = edge[order], order // 3
    # An edge is balanced if it is walked once each way; no run can end while an edge is unbalanced.
    ending = np.append(edge[1:] != edge[:-1], True)
    walked = np.cumsum(np.sign(b - a)[order])
    before = np.repeat(np.append(0, walked[ending][:-1]), np.diff(np.append(-1, np.flatnonzero(ending))))
    open_after = walked != before
    until = np.where(ending, count, np.append(face[1:], count))
    depth = np.bincount(face[open_after], minlength=count + 1) - np.bincount(until[open_after], minlength=count + 1)
    may_end = np.cumsum(depth)[:count] == 0
    run = np.cumsum(np.append(0, may_end[:-1]))
    if not run[-1]:
        return mesh
    own, index = np.unique(run[:, None] * len(mesh.vertices_m) + faces, return_inverse=True)
    return TriangleMesh(mesh.vertices_m[own % len(mesh.vertices_m)], index.reshape(-1, 3).astype(np.int32))


def _with_own_vertices(mesh: TriangleMesh, faces: NDArray[np.int32]) -> TriangleMesh:
    used, own = np.unique(faces, return_inverse=True)
    return TriangleMesh(mesh.vertices_m[used], own.reshape(-1, 3).astype(np.int32))


def _owners(shells: Shells) -> NDArray[np.int64]:
    """Return, for each shell, the lowest shell of its body."""
    owner = np.arange(len(shells.closed), dtype=np.int64)
    size = np.prod(shells.high_m - shells.low_m, axis=1)
    outward, inward = (np.flatnonzero(shells.closed & (np.sign(shells.volume_m3) == sign)) for sign in (1.0, -1.0))
    for guests, hosts in ((outward, inward), (inward, outward)):
        if not len(hosts):
            continue
        low, high = shells.low_m[hosts], shells.high_m[hosts]
        for guest in guests:
            around = (low <= shells.low_m[guest]).all(axis=1) & (high >= shells.high_m[guest]).all(axis=1)
            near = hosts[around & (size[hosts] > size[guest])]
            if len(near):
                owner[guest] = near[np.argmin(size[near])]
    loose = np.flatnonzero(~shells.closed)
    if len(loose) > 1:
        owner[loose] = loose[touching_groups(shells.low_m[loose], shells.high_m[loose])]
    return np.minimum(owner, owner[owner])


def touching_groups(low_m: NDArray[np.float64], high_m: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return, for each of N boxes, the lowest box that it is connected to through boxes that touch.

    Args:
        low_m: (N, 3) lowest corners.
        high_m: (N, 3) highest corners.
    """
    # Sweeps along the longest axis, where a box meets the fewest others.
    sweep = int(np.argmax(high_m.max(axis=0) - low_m.min(axis=0)))
    order = np.argsort(low_m[:, sweep], kind="stable")
    return _groups(low_m[order], high_m[order], order, sweep)


@kernel
def _groups(
    low_m: NDArray[np.float64], high_m: NDArray[np.float64], order: NDArray[np.int64], sweep: int
) -> NDArray[np.int64]:
    """Return the groups of boxes sorted by their low side: compares each with those that begin before it ends."""
    count = len(order)
    root = np.arange(count)
    for one in range(count):
        for other in range(one + 1, count):
            if low_m[other, sweep] > high_m[one, sweep]:
                break
            touch = True
            for axis in range(3):
                touch = touch and low_m[one, axis] <= high_m[other, axis] and low_m[other, axis] <= high_m[one, axis]
            if not touch:
                continue
            a, b = order[one], order[other]
            while root[a] != a:
                root[a] = root[root[a]]
                a = root[a]
            while root[b] != b:
                root[b] = root[root[b]]
                b = root[b]
            root[max(a, b)] = min(a, b)
    for box in range(count):
        while root[box] != root[root[box]]:
            root[box] = root[root[box]]
    return root
