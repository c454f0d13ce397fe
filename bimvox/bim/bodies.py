"""Cut a lump of triangles without names into the bodies that could be lifted one by one."""

from __future__ import annotations

import numpy as np

from bimvox.bim.building import TriangleMesh
from bimvox.bim.connected import connected_labels
from bimvox.bim.mesh_repair import Shells, shells_of, weld


def bodies_of(mesh: TriangleMesh) -> list[TriangleMesh]:
    """Split a welded mesh into bodies, in the order of their first face.

    A closed shell is a body, together with its cavities (closed shells inside its box that face the other way). Open
    pieces whose boxes touch are one body: a surface that was exported in patches, or as loose triangles, is one thing.
    """
    shells = shells_of(mesh)
    owner = _owners(shells)
    body_of_face = owner[shells.of_face]
    return [
        weld(TriangleMesh(mesh.vertices_m, mesh.faces[body_of_face == body])) for body in dict.fromkeys(owner.tolist())
    ]


def _owners(shells: Shells) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """Return for each shell the lowest shell of its body."""
    owner = np.arange(len(shells.closed), dtype=np.int64)
    facing = np.sign(shells.volume_m3)
    size = np.prod(shells.high_m - shells.low_m, axis=1)
    for shell in np.flatnonzero(shells.closed):
        around = (shells.low_m <= shells.low_m[shell]).all(axis=1) & (shells.high_m >= shells.high_m[shell]).all(axis=1)
        hosts = np.flatnonzero(around & shells.closed & (facing == -facing[shell]) & (size > size[shell]))
        if len(hosts):
            owner[shell] = hosts[np.argmin(size[hosts])]
    loose = np.flatnonzero(~shells.closed)
    if len(loose):
        owner[loose] = loose[_touching(shells, loose)]
    return np.minimum(owner, owner[owner])


def _touching(
    shells: Shells, which: np.ndarray[tuple[int], np.dtype[np.int64]]
) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """Group shells whose boxes touch, swept along x so that many small pieces need no table of all pairs."""
    order = which[np.argsort(shells.low_m[which, 0], kind="stable")]
    place = {int(shell): index for index, shell in enumerate(which)}
    low, high = shells.low_m[order], shells.high_m[order]
    ends = np.searchsorted(low[:, 0], high[:, 0], side="right")
    a, b = [], []
    for index, end in enumerate(ends):
        near = np.arange(index + 1, end)
        hit = near[((low[near] <= high[index]) & (high[near] >= low[index])).all(axis=1)]
        b += [place[int(order[other])] for other in hit]
        a += [place[int(order[index])]] * len(hit)
    return connected_labels(len(which), np.array(a, dtype=np.int64), np.array(b, dtype=np.int64))
