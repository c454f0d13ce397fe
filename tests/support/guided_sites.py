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
