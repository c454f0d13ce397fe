"""A generated office building: storeys of slabs, frames, walls, stairs, a glazed facade and a rotated wing.

About 1,400 closed parts, 76,000 triangles, 30 million cells at 0.1 m. Sizes are those of drawings, so many faces lie
on a 5 or 10 mm grid and some on cell borders; the wing, the braces and the stairs' rails do not.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise, product

import numpy as np

from benchmarks.voxelize.prisms import (
    box,
    joined,
    lattice_prism,
    moved,
    pipe,
    round_prism,
    stood_up,
    turned,
)
from bimvox.bim.building import Building, Element, Role, Source, TriangleMesh

LENGTH_M, WIDTH_M, STOREY_M = 30.0, 16.2, 3.6
SLAB_M = 0.28
BAY_X_M, BAY_Y_M = 6.0, 5.4
WING_TURN_RAD = np.deg2rad(23.0)
# The stair well, in the bay of the slab's second column of bays.
WELL_X_M, WELL_Y_M = (7.0, 11.4), (5.9, 8.4)
_DENSITY = 2400.0


@dataclass(frozen=True, slots=True)
class _Piece:
    kind: str
    ifc_class: str
    mesh: TriangleMesh


def office(storeys: int = 10) -> Building:
    """Return the building; ``storeys`` scales it."""
    elements: list[Element] = []
    for storey in range(storeys):
        for piece in (*_frame(storey), *_walls(storey), *_stairs(storey), *_facade(storey), *_services(storey)):
            elements.append(_element(piece, len(elements), storey, storey * STOREY_M))
        if storey < (storeys + 1) // 2:
            elements += [
                _element(piece, len(elements) + n, storey, storey * STOREY_M) for n, piece in enumerate(_wing())
            ]
    return Building(tuple(elements), (), Source(f"office-{storeys}", "0" * 64, "generated", "m"))


def _element(piece: _Piece, number: int, storey: int, level_m: float) -> Element:
    mesh = moved(piece.mesh, 0.0, 0.0, level_m)
    name = f"{piece.kind}-{number:04d}"
    return Element(
        id=name,
        global_id=name,
        ifc_class=piece.ifc_class,
        name=name,
        mesh=mesh,
        role=Role.COMPONENT,
        mass_kg=mesh.signed_volume_m3 * _DENSITY,
        mass_source="default",
        storey=f"storey {storey}",
    )


def i_section(height: float, width: float, web: float, flange: float, length: float) -> TriangleMesh:
    """Return an I-section along x from 0, centred in y, its top at z = 0."""
    across = (-width / 2, -web / 2, web / 2, width / 2)
    up = (-height, flange - height, -flange, 0.0)
    profile = [[True, False, True], [True, True, True], [True, False, True]]
    # Drawn in (y, z) and extruded along x.
    x, y, z = lattice_prism(across, up, profile, 0.0, length).vertices_m.T
    faces = lattice_prism(across, up, profile, 0.0, length).faces
    return TriangleMesh(np.stack([z, x, y], axis=-1), faces)


def wall_with_openings(
    length: float, height: float, thickness: float, openings: list[tuple[float, float, float, float]]
) -> TriangleMesh:
    """Return a wall along x from 0, thickness to positive y, with openings (x0, x1, z0, z1) cut."""
    xs = sorted({0.0, length, *(x for o in openings for x in o[:2])})
    zs = sorted({0.0, height, *(z for o in openings for z in o[2:])})
    filled = [[not any(o[0] <= x < o[1] and o[2] <= z < o[3] for o in openings) for z in zs[:-1]] for x in xs[:-1]]
    return moved(stood_up(lattice_prism(xs, zs, filled, 0.0, thickness)), 0.0, thickness, 0.0)


def _frame(storey: int) -> Iterator[_Piece]:
    xs = np.arange(0.0, LENGTH_M + 0.1, BAY_X_M)
    ys = np.arange(0.0, WIDTH_M + 0.1, BAY_Y_M)
    edges_x = (-0.2, *WELL_X_M, 22.1, 23.3, LENGTH_M + 0.2)
    edges_y = (-0.2, *WELL_Y_M, 10.15, 11.35, WIDTH_M + 0.2)
    slab = np.ones((5, 5), np.bool_)
    slab[1, 1] = slab[3, 3] = False
    yield _Piece("slab", "IfcSlab", moved(lattice_prism(edges_x, edges_y, slab, 0.0, SLAB_M), 0.0, 0.0, -SLAB_M))
    height = STOREY_M - SLAB_M
    for n, (x, y) in enumerate(product(xs.tolist(), ys.tolist())):
        square = moved(box((0.4, 0.4, height)), -0.2, -0.2, 0.0)
        yield _Piece("column", "IfcColumn", moved(round_prism(0.225, height, 16) if n % 2 else square, x, y, 0.0))
    top = height
    for y in ys.tolist():
        for x0, x1 in pairwise(xs.tolist()):
            yield _Piece(
                "beam", "IfcBeam", moved(i_section(0.36, 0.17, 0.008, 0.0127, x1 - x0 - 0.46), x0 + 0.23, y, top)
            )
    for x in xs[1:-1].tolist():
        for y0, y1 in pairwise(ys.tolist()):
            beam = turned(i_section(0.27, 0.135, 0.0066, 0.0102, y1 - y0 - 0.46), np.pi / 2)
            yield _Piece("beam", "IfcBeam", moved(beam, x, y0 + 0.23, top))
    if storey % 2 == 0:
        for x0 in (0.0, LENGTH_M - BAY_X_M):
            brace = pipe(0.07, 0.008, 6.5, 12)
            yield _Piece("brace", "IfcMember", moved(turned(brace, np.deg2rad(62.0), 1), x0 + 0.1, 0.35, 0.1))


def _walls(storey: int) -> Iterator[_Piece]:
    height = STOREY_M - SLAB_M
    windows = [(1.1 + 2.7 * n, 2.5 + 2.7 * n, 0.9, 2.35) for n in range(5)]
    for x in (-0.2, LENGTH_M):
        gable = turned(wall_with_openings(WIDTH_M - 0.9, height - 0.4, 0.2, windows), np.pi / 2)
        yield _Piece("gable", "IfcWall", moved(gable, x + 0.2, 0.45, 0.0))
    for n, x in enumerate((3.1, 12.6, 15.35, 18.9, 24.4, 27.7)):
        door = 0.5 + 0.35 * ((n + storey) % 4)
        partition = turned(wall_with_openings(5.0, height - 0.3, 0.1, [(door, door + 0.9, 0.0, 2.1)]), np.pi / 2)
        yield _Piece("partition", "IfcWall", moved(partition, x, 0.3 + 5.2 * ((n + storey) % 3), 0.0))
        lining = turned(wall_with_openings(5.0, height - 0.3, 0.0125, [(door, door + 0.9, 0.0, 2.1)]), np.pi / 2)
        yield _Piece("lining", "IfcCovering", moved(lining, x + 0.0125, 0.3 + 5.2 * ((n + storey) % 3), 0.0))
    core = [(0.9, 1.9, 0.0, 2.1)]
    for y in (WELL_Y_M[0] - 0.25, WELL_Y_M[1] + 0.05):
        yield _Piece("core", "IfcWall", moved(wall_with_openings(4.4, height, 0.2, core), WELL_X_M[0], y, 0.0))


def _stairs(storey: int) -> Iterator[_Piece]:
    steps, tread, riser = 10, 0.27, STOREY_M / 20
    lines_x = [tread * n for n in range(steps + 1)]
    lines_z = [riser * n for n in range(-1, steps + 1)]
    profile = [[j <= i + 1 and j >= i - 1 for j in range(steps + 1)] for i in range(steps)]
    flight = stood_up(lattice_prism(lines_x, lines_z, profile, 0.0, 1.15))
    x, y = WELL_X_M[0] + 1.4, WELL_Y_M[0] + 1.15
    yield _Piece("flight", "IfcStairFlight", moved(flight, x, y, 0.0))
    back = turned(flight, np.pi)
    yield _Piece("flight", "IfcStairFlight", moved(back, x + steps * tread, y + 0.15, STOREY_M / 2))
    yield _Piece(
        "landing", "IfcSlab", moved(box((0.29, 2.45, 0.18)), WELL_X_M[1] - 0.29, y - 1.15, STOREY_M / 2 - 0.18)
    )
    slope = float(np.arctan2(riser, tread))
    rail = turned(pipe(0.021, 0.0026, steps * float(np.hypot(tread, riser)), 10), np.pi / 2 - slope, 1)
    yield _Piece("rail", "IfcRailing", moved(rail, x, y + 0.06 - 0.01 * (storey % 3), 1.0))


def _facade(storey: int) -> Iterator[_Piece]:
    width, height, bar = 2.5, STOREY_M - 0.02, 0.06
    frame = lattice_prism(
        (0.0, bar, width - bar, width), (0.0, bar, height - bar, height), [[True] * 3, [True, False, True], [True] * 3],
        0.0, 0.12,
    )  # fmt: skip
    frame = stood_up(frame)
    pane = box((width - 2 * bar, 0.012, height - 2 * bar))
    for n in range(12):
        x = width * n
        for y, kind in ((-0.21, "front"), (WIDTH_M + 0.33, "back")):
            yield _Piece(f"frame-{kind}", "IfcMember", moved(frame, x, y, -SLAB_M))
            yield _Piece(f"glass-{kind}", "IfcPlate", moved(pane, x + bar, y - 0.07, bar - SLAB_M))
            if storey % 3 == 1 and n % 4 == 3:
                fin = turned(box((0.05, 0.6, height)), np.deg2rad(31.0))
                yield _Piece("fin", "IfcPlate", moved(fin, x + 0.7, y + (0.02 if kind == "back" else -0.73), -SLAB_M))


def _services(storey: int) -> Iterator[_Piece]:
    for n, y in enumerate((2.6, 8.9, 13.4)):
        duct = turned(pipe(0.16 + 0.03 * n, 0.0008, 16.0, 16), np.pi / 2, 1)
        yield _Piece("duct", "IfcDuctSegment", moved(duct, 12.5, y, 2.85))
    riser = joined(*(moved(pipe(0.055, 0.0032, STOREY_M, 10), 0.2 * n, 0.0, 0.0) for n in range(5)))
    yield _Piece("risers", "IfcPipeSegment", moved(riser, 22.3, 10.6, -0.01 * (storey % 2)))


def _wing() -> Iterator[_Piece]:
    """Yield a lower wing at an angle, not aligned with the lattice."""
    length, width = 10.0, 5.0

    def placed(mesh: TriangleMesh, x: float, y: float, z: float) -> TriangleMesh:
        return moved(turned(moved(mesh, x, y, z), WING_TURN_RAD), 17.0, WIDTH_M + 1.3, 0.0)

    height = STOREY_M - 0.2
    yield _Piece("wing-slab", "IfcSlab", placed(box((length, width, 0.2)), 0.0, 0.0, -0.2))
    windows = [(0.8 + 2.4 * n, 2.2 + 2.4 * n, 0.9, 2.3) for n in range(4)]
    for y in (0.0, width - 0.15):
        yield _Piece("wing-wall", "IfcWall", placed(wall_with_openings(length, height, 0.15, windows), 0.0, y, 0.0))
    for n in range(4):
        column = placed(round_prism(0.15, height, 16), 1.2 + 2.5 * n, width / 2, 0.0)
        yield _Piece("wing-column", "IfcColumn", column)
        beam = turned(i_section(0.2, 0.1, 0.0056, 0.0085, width - 0.3), np.pi / 2)
        yield _Piece("wing-beam", "IfcBeam", placed(beam, 1.2 + 2.5 * n, 0.15, height))
    for n in range(4):
        pane = placed(box((1.4, 0.008, 1.4)), 0.8 + 2.4 * n, 0.07, 0.9)
        yield _Piece("wing-glass", "IfcPlate", pane)
