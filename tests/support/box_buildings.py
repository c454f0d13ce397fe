"""Small buildings made of boxes, for tests of voxelization and earlier stages."""

from __future__ import annotations

import numpy as np
from box_sites import box_cells, box_mesh

from bimvox.bim.building import Building, Element, Role, Source, TriangleMesh
from bimvox.grid.frame import GridFrame


def box_element(name: str, low, high, *, role: Role = Role.COMPONENT, **more) -> Element:
    size = np.array(high, float) - np.array(low, float)
    return Element(
        id=name,
        global_id=more.pop("global_id", name),
        ifc_class=more.pop("ifc_class", "IfcBeam"),
        name=more.pop("name", name),
        mesh=box_mesh(low, high),
        role=role,
        mass_kg=more.pop("mass_kg", float(np.prod(size) * 2400)),
        mass_source="default",
        **more,
    )


def building_of(*elements: Element, origin_m=(0.0, 0.0, 0.0)) -> Building:
    source = Source("boxes.ifc", "0" * 64, "IFC4", "m")
    return Building(tuple(elements), (), source, origin_m=np.array(origin_m, float))


def frame_house() -> Building:
    """Return four columns on a footing, with two beams and a slab on them; 8 x 5 m on plan."""
    columns = [
        box_element(f"column-{n}", (x, y, 0.5), (x + 0.3, y + 0.3, 3.5), ifc_class="IfcColumn")
        for n, (x, y) in enumerate([(0.0, 0.0), (7.7, 0.0), (0.0, 4.7), (7.7, 4.7)])
    ]
    beams = [
        box_element(f"beam-{n}", (0.0, y, 3.5), (8.0, y + 0.3, 4.0), ifc_class="IfcBeam")
        for n, y in enumerate([0.0, 4.7])
    ]
    slab = box_element("slab", (0.0, 0.0, 4.0), (8.0, 5.0, 4.2), ifc_class="IfcSlab", mass_kg=4500.0)
    footing = box_element("footing", (-0.5, -0.5, 0.0), (8.5, 5.5, 0.5), role=Role.STRUCTURE, ifc_class="IfcFooting")
    door = box_element("door", (3.0, 0.0, 0.5), (4.0, 0.2, 2.5), role=Role.FITTING, ifc_class="IfcDoor")
    return building_of(footing, *columns, *beams, slab, door)


def rasterise_boxes(mesh: TriangleMesh, frame: GridFrame, shape) -> np.ndarray:
    """Return the cells of a box mesh, cut to the grid."""
    low, high = mesh.bounds_m
    low, high = np.maximum(low, frame.corner_of((0, 0, 0))), np.minimum(high, frame.corner_of(shape))
    if (high <= low).any():
        return np.zeros((0, 3), np.int32)
    return box_cells(frame, low, high)
