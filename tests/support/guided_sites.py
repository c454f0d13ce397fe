"""A slab between the flanges of two beams: it gets to its place only when a crew guides it."""

import dataclasses

import numpy as np
from box_sites import box_cells, box_mesh, box_site, test_crane

from bimvox.bim.building import TriangleMesh
from bimvox.site.build import labels_of
from bimvox.site.site import Blocker, Site

SLAB = ("slab", (4.0, 4.0, 3.42), (9.0, 5.2, 3.57))


def joined(frame, name, *boxes) -> Blocker:
    """Return one piece of structure made of several boxes."""
    meshes = [box_mesh(low, high) for low, high in boxes]
    vertices = np.concatenate([mesh.vertices_m for mesh in meshes])
    faces = np.concatenate([mesh.faces + 8 * n for n, mesh in enumerate(meshes)])
    cells = np.unique(np.concatenate([box_cells(frame, low, high) for low, high in boxes]), axis=0)
    return Blocker(name, "structure", cells, TriangleMesh(vertices, faces))


def beam(frame, name, web_m, south_m=0.1) -> Blocker:
    """Return a steel beam along y: flanges 0.3 m wide, 0.3 m apart, on posts of no concern."""
    west, east = web_m - 0.15, web_m + 0.15
    lower = ((west, south_m, 3.4), (east, south_m + 9.0, 3.42))
    web = ((web_m - 0.005, south_m, 3.42), (web_m + 0.005, south_m + 9.0, 3.72))
    upper = ((west, south_m, 3.72), (east, south_m + 9.0, 3.74))
    return joined(frame, name, lower, web, upper)


def slab_between_beams(aside_m: float = 0.0, **more) -> Site:
    """Return a site with a slab 5 m long between webs 5.18 m apart; their flanges leave 4.88 m."""
    crane = more.pop("crane", test_crane(base=(10.0, -3.0, 0.0)))
    site = box_site([SLAB], crane=crane, **more)
    beams = beam(site.frame, "west", 3.91 - aside_m), beam(site.frame, "east", 9.09)
    site = dataclasses.replace(site, blockers=(*site.blockers, *beams))
    return dataclasses.replace(site, labels=labels_of(site))


def bays_of_slabs(bays: int = 3, rows: int = 6) -> Site:
    """Return a site with slabs side by side in bays between beams; a crew guides each of them to its place."""
    webs_m = [3.91 + 5.18 * n for n in range(bays + 1)]
    slabs = [
        (f"slab {n} {row}", (west + 0.09, 0.4 + 1.4 * row, 3.42), (west + 5.09, 1.6 + 1.4 * row, 3.57))
        for n, west in enumerate(webs_m[:-1])
        for row in range(rows)
    ]
    crane = test_crane(base=(12.0, -3.0, 0.0), jib=60.0, height=14.0)
    site = box_site(slabs, crane=crane, shape=(120, 40, 24), yard=((50.0, 0.0), (118.0, 40.0)))
    beams = [beam(site.frame, f"beam {n}", web_m) for n, web_m in enumerate(webs_m)]
    site = dataclasses.replace(site, blockers=(*site.blockers, *beams))
    return dataclasses.replace(site, labels=labels_of(site))
