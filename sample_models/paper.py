"""The paper's site: a slab of 15 x 15 cells of 1 m, and one column of 4 cells in its middle."""

from __future__ import annotations

from sample_models.ifc_author import IfcAuthor


def paper_ifc() -> bytes:
    """Return the paper's site as IFC4; the slab, with its top at z = 0, is the terrain of the IfcSite."""
    ifc = IfcAuthor("paper")
    slab = ifc.body_of([ifc.box((0, 0, -1), (15, 15, 0))])
    shape = ifc.add("IfcProductDefinitionShape", Representations=[slab])
    site = ifc.spatial("IfcSite", "Slab", Representation=shape)
    building = ifc.spatial("IfcBuilding", "Building", within=site)
    storey = ifc.storey("Ground floor", 0.0, within=building)
    body = ifc.body_of([ifc.box((-0.5, -0.5, 0), (0.5, 0.5, 4))])
    column = ifc.product("IfcColumn", "Column", (7.5, 7.5, 0), within=storey, body=body, PredefinedType="COLUMN")
    ifc.contain(storey, [column])
    return ifc.to_bytes("paper.ifc")
