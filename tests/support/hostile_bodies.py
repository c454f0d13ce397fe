"""Bodies as joins, voids and careless exports leave them, each between good parts of a small frame."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from box_buildings import box_element, building_of
from box_sites import box_mesh

from bimvox.bim.building import Building, Element, Role, TriangleMesh

NAME = "bad"
LOW, HIGH = (0.3, 0.0, 3.0), (5.7, 0.3, 3.5)
"""The place of the bad part: a beam between the heads of two columns, with its ends flush with them."""


def prism(outline, low: float, high: float, axis: int = 1) -> TriangleMesh:
    """Return a star-shaped outline, counter-clockwise in the plane across an axis, drawn along that axis."""
    flat, count = np.array(outline, float), len(outline)
    middle = flat.mean(axis=0)
    ends = []
    for at in (low, high):
        points = np.insert(np.vstack([flat, middle]), axis, at, axis=1)
        ends.append(points)
    ring = np.arange(count)
    after = np.roll(ring, -1)
    other, hub, far_hub = ring + count + 1, np.full(count, count), np.full(count, 2 * count + 1)
    faces = np.concatenate(
        [
            np.c_[after, ring, hub],
            np.c_[other, np.roll(other, -1), far_hub],
            np.c_[ring, after, other],
            np.c_[after, np.roll(other, -1), other],
        ]
    ).astype(np.int32)
    mesh = TriangleMesh(np.concatenate(ends), faces)
    return mesh if mesh.signed_volume_m3 > 0 else turned_over(mesh)


def turned_over(mesh: TriangleMesh) -> TriangleMesh:
    return TriangleMesh(mesh.vertices_m, np.ascontiguousarray(mesh.faces[:, ::-1]))


def joined(*meshes: TriangleMesh) -> TriangleMesh:
    return TriangleMesh.joined(meshes)


def beam() -> TriangleMesh:
    return box_mesh(LOW, HIGH)


def without(mesh: TriangleMesh, *faces: int) -> TriangleMesh:
    return TriangleMesh(mesh.vertices_m, np.delete(mesh.faces, faces, axis=0))


def sliver(thick_m: float) -> TriangleMesh:
    """Return the beam with a veil over the side of the column: what a void leaves that is a little too small."""
    return joined(beam(), box_mesh((0.1, -thick_m, 3.0), (0.31, 0.0, 3.5)))


def sliver_in_one_piece(thick_m: float) -> TriangleMesh:
    """Return the beam with such a veil, in one closed surface."""
    x0, x1, y1 = 0.1, 5.7, 0.3
    plan = [(x0, -thick_m), (x1, -thick_m), (x1, y1), (0.3, y1), (0.3, 0.0), (x0, 0.0)]
    faces = np.array([(0, 1, 4), (1, 2, 4), (2, 3, 4), (0, 4, 5)])
    points = np.array([(x, y, z) for z in (3.0, 3.5) for x, y in plan])
    sides = [((n, (n + 1) % 6, 6 + n), ((n + 1) % 6, 6 + (n + 1) % 6, 6 + n)) for n in range(6)]
    both = np.concatenate([faces[:, ::-1], faces + 6, np.array(sides).reshape(-1, 3)])
    return TriangleMesh(points, both.astype(np.int32))


def spike(wide_m: float) -> TriangleMesh:
    """Return the beam with a needle out of its end, along the side of the column."""
    return joined(
        beam(),
        prism([(0.3, 3.2), (0.3, 3.2 + wide_m), (-0.4, 3.2 + wide_m / 2)], -wide_m, 0.0),
    )


def spike_through(wide_m: float) -> TriangleMesh:
    """Return the beam with a needle through the column."""
    return joined(beam(), prism([(0.3, 3.2), (0.3, 3.2 + wide_m), (-0.4, 3.2 + wide_m / 2)], 0.1, 0.1 + wide_m))


def notched() -> TriangleMesh:
    """Return the beam with a slot of 0.4 mm all through it."""
    return joined(box_mesh(LOW, (3.0, 0.3, 3.5)), box_mesh((3.0004, 0.0, 3.0), HIGH))


def sunk(depth_m: float) -> TriangleMesh:
    """Return the beam drawn into the column and without its ends."""
    low, high = (LOW[0] - depth_m, *LOW[1:]), HIGH
    return without(box_mesh(low, high), 8, 9, 10, 11)


def flat() -> TriangleMesh:
    mesh = beam()
    return TriangleMesh(np.where([True, False, True], mesh.vertices_m, 0.15), mesh.faces)


def wrinkled(seed: int = 1) -> TriangleMesh:
    """Return the beam with triangles that have no area, or hardly any."""
    mesh, rng = beam(), np.random.default_rng(seed)
    a, b = mesh.vertices_m[mesh.faces[:6, 0]], mesh.vertices_m[mesh.faces[:6, 1]]
    points = np.concatenate([a, b, (a + b) / 2 + rng.normal(0, 1e-7, a.shape)])
    count = len(mesh.vertices_m)
    more = np.array([(count + n, count + 6 + n, count + 12 + n) for n in range(6)], np.int32)
    return TriangleMesh(np.concatenate([mesh.vertices_m, points]), np.concatenate([mesh.faces, more]))


BODIES: dict[str, Callable[[], TriangleMesh]] = {
    "sliver of 0.27 mm": lambda: sliver(0.00027),
    "sliver of 0.27 mm in one piece": lambda: sliver_in_one_piece(0.00027),
    "sliver of 2 mm in one piece": lambda: sliver_in_one_piece(0.002),
    "spike of 0.6 mm": lambda: spike(0.0006),
    "spike of 0.6 mm through a column": lambda: spike_through(0.0006),
    "spike of 6 mm through a column": lambda: spike_through(0.006),
    "slot of 0.4 mm": notched,
    "open shell": lambda: without(beam(), 0, 1),
    "open shell, inside out": lambda: turned_over(without(beam(), 2)),
    "open shell drawn 5 mm in": lambda: sunk(0.005),
    "open shell drawn 0.15 m in": lambda: sunk(0.15),
    "doubled faces": lambda: joined(beam(), beam()),
    "doubled faces, both sides": lambda: joined(beam(), turned_over(beam())),
    "inside out": lambda: turned_over(beam()),
    "flat": flat,
    "one triangle": lambda: TriangleMesh(beam().vertices_m, beam().faces[4:5]),
    "crosses itself": lambda: joined(beam(), box_mesh((2.0, 0.1, 2.9), (2.5, 0.2, 3.6))),
    "triangles without area": wrinkled,
    "drawn 0.15 m in": lambda: box_mesh((0.15, *LOW[1:]), HIGH),
    "drawn into everything": lambda: box_mesh((-0.2, -0.2, 0.2), (6.2, 4.2, 4.2)),
    "as the slab": lambda: box_mesh((0.0, 0.0, 3.5), (6.0, 4.0, 3.7)),
    "far away": lambda: box_mesh((900.0, 900.0, 0.5), (901.0, 901.0, 1.5)),
    "in a wrong unit": lambda: box_mesh((-300.0, 0.0, 3.0), (5100.0, 300.0, 503.0)),
    "tiny": lambda: box_mesh((3.0, 2.0, 3.7), (3.0004, 2.0004, 3.7004)),
    "below the ground": lambda: box_mesh((1.0, 1.0, -3.0), (1.4, 1.4, -1.0)),
}


def hostile_frame(body: TriangleMesh, *others: Element, **more) -> Building:
    """Return four columns, a beam, a slab, and the bad part."""
    columns = [
        box_element(f"column-{n}", (x, y, 0.5), (x + 0.3, y + 0.3, 3.5), ifc_class="IfcColumn")
        for n, (x, y) in enumerate([(0.0, 0.0), (5.7, 0.0), (0.0, 3.7), (5.7, 3.7)])
    ]
    good = box_element("beam", (0.3, 3.7, 3.0), (5.7, 4.0, 3.5))
    slab = box_element("slab", (0.0, 0.0, 3.5), (6.0, 4.0, 3.7), ifc_class="IfcSlab")
    footing = box_element("footing", (-0.5, -0.5, 0.0), (6.5, 4.5, 0.5), role=Role.STRUCTURE, ifc_class="IfcFooting")
    mass_kg = more.pop("mass_kg", 1944.0)
    bad = Element(
        NAME, NAME, "IfcBeam", NAME, body, Role.COMPONENT, mass_kg, more.pop("mass_source", "quantity"), **more
    )
    return building_of(footing, *columns, good, bad, slab, *others)
