"""Read an IFC file into a building: products to meshes, meshes to elements, elements to roles."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from bimvox.bim.building import Building, Element, Role, SkippedProduct, Source, TriangleMesh
from bimvox.bim.ifc_assembly import Extent
from bimvox.bim.ifc_elements import ElementBuilder, Part
from bimvox.bim.ifc_geometry import GeometryPool, ProductShape
from bimvox.bim.ifc_georeference import georeference_of
from bimvox.bim.ifc_open import OpenedIfc, open_ifc
from bimvox.bim.ifc_roles import UNKNOWN, reason_not_solid, reason_too_small, role_of_class
from bimvox.bim.local_origin import FAR_M, local_origin, stray
from bimvox.bim.mesh_repair import drop_bad_faces, solid_volume_m3, turn_outward
from bimvox.bim.options import Progress, ReadOptions
from bimvox.errors import IfcError, InputError, SelectionError

HAND_CARRIED_KG = 5.0
"""A part lighter than this is no crane lift, unless every part is (a model at toy scale) or a query says so."""


def read_ifc(
    path: Path, data: bytes, sha256: str, options: ReadOptions, report: Progress, pool: GeometryPool
) -> Building:
    """Read an IFC file.

    Args:
        path: The file, which the pool works on too.
        data: Its bytes.
        sha256: Their hash.
        options: What to lift and how.
        report: Told about progress.
        pool: Geometry workers, already starting.

    Raises:
        IfcError: If the file cannot be used or holds nothing solid.
        SelectionError: If the query is malformed or selects nothing solid.
        InputError: If a unit is asked for that the file contradicts.
    """
    report("open", 0, 1)
    opened = open_ifc(path, data)
    if options.unit is not None and options.unit != opened.unit:
        raise InputError(f"{path}: states its unit itself ({opened.unit}), not {options.unit}", hint="leave unit out")
    selected = _selected(opened, options)
    report("open", 1, 1)

    wanted, skipped = _sort_out(opened, selected)
    meshed = pool.mesh(wanted, lambda done: report("geometry", done, len(wanted)))
    skipped.update({step_id: _why(opened.file.by_id(step_id), why) for step_id, why in meshed.failures.items()})
    notes = list(opened.notes)
    if meshed.retried:
        notes.append(f"products that needed the slower geometry library: {len(meshed.retried)}")

    origin_m = local_origin([_bounds(shape) for shape in meshed.shapes.values()])
    parts = _clean(meshed.shapes, origin_m, skipped, notes)
    if not parts:
        reasons = "; ".join(f"{count} x {reason}" for reason, count in Counter(skipped.values()).most_common(3))
        raise IfcError(
            path, f"holds nothing solid ({reasons or 'no product has geometry'})", hint="export it with 3D bodies"
        )
    builder = ElementBuilder(opened, parts, selected)
    groups = builder.groups(options.assemblies)
    elements = []
    for index, group in enumerate(groups):
        elements.append(builder.element(group))
        report("elements", index + 1, len(groups))
    notes += builder.notes()
    elements = _without_small_parts(_promoted(elements, notes), notes) if selected is None else elements
    if selected is not None and not any(element.role is Role.COMPONENT for element in elements):
        raise SelectionError(
            f"select {options.select!r}: matches {len(selected)} products, none of them solid",
            hint="select columns, beams, walls, slabs or other elements with a body",
        )
    for index in stray([element.mesh.bounds_m for element in elements]):
        notes.append(f"{elements[index].id} ({elements[index].ifc_class}) lies over {FAR_M:g} m from the rest")
    return Building(
        elements=tuple(elements),
        skipped=tuple(_skipped(opened.file, skipped)),
        source=Source(path.name, sha256, opened.schema, opened.unit),
        origin_m=origin_m,
        georeference=georeference_of(opened.file, opened.metres_per_unit),
        notes=tuple(notes),
    )


def _selected(opened: OpenedIfc, options: ReadOptions) -> frozenset[int] | None:
    """Return the step ids that the query selects, None without a query."""
    if options.select is None:
        return None
    from bimvox.bim.ifc_select import select_products  # the selector takes half a second to import

    return select_products(opened.file, options.select)


def _sort_out(opened: OpenedIfc, selected: frozenset[int] | None) -> tuple[list[int], dict[int, str]]:
    """Return the step ids to mesh, ascending, and the reason for every other product with a representation."""
    wanted, skipped = [], {}
    for product in opened.file.by_type("IfcProduct"):
        if product.Representation is None:
            continue
        step_id, ifc_class = product.id(), product.is_a()
        reason = reason_not_solid(opened.schema, ifc_class)
        if reason is None and (selected is None or step_id not in selected):
            reason = reason_too_small(opened.schema, ifc_class)
        if reason is None and role_of_class(opened.schema, ifc_class) is None:
            reason = "not a building element"
        if reason is None:
            wanted.append(step_id)
        else:
            skipped[step_id] = reason
    return sorted(wanted), skipped


def _bounds(shape: ProductShape) -> Any:
    """Return the (2, 3) world box of a shape."""
    world_m = shape.world_m(np.zeros(3))[np.unique(shape.faces)]
    return np.stack([world_m.min(axis=0), world_m.max(axis=0)])


def _clean(
    shapes: Mapping[int, ProductShape], origin_m: Any, skipped: dict[int, str], notes: list[str]
) -> dict[int, Part]:
    """Place, repair and measure the shapes; what has no area goes to ``skipped``."""
    parts: dict[int, Part] = {}
    dropped = flipped = 0
    for step_id in sorted(shapes):
        shape = shapes[step_id]
        mesh, bad = drop_bad_faces(TriangleMesh(shape.world_m(origin_m), shape.faces))
        dropped += bad
        if not len(mesh.faces):
            skipped[step_id] = "its triangles have no area"
            continue
        mesh, shells, turned = turn_outward(mesh)
        flipped += turned
        volume_m3, exact = solid_volume_m3(mesh, shells)
        low, high = mesh.bounds_m
        parts[step_id] = Part(mesh, Extent(low, high, volume_m3), exact)
    if dropped:
        notes.append(f"triangles without area dropped: {dropped}")
    if flipped:
        notes.append(f"inside-out products turned outward: {flipped}")
    return parts


def _why(product: Any, reason: str) -> str:
    """Add to a kernel's failure what the product has instead of a body."""
    shown = [item.RepresentationIdentifier for item in getattr(product.Representation, "Representations", ())]
    return f"{reason}; its representations: {', '.join(str(name) for name in shown)}" if shown else reason


def _skipped(file: Any, reasons: Mapping[int, str]) -> list[SkippedProduct]:
    """Return the skipped products in file order."""
    products = [(file.by_id(step_id), reasons[step_id]) for step_id in sorted(reasons)]
    return [
        SkippedProduct(str(product.GlobalId), product.is_a(), str(product.Name or ""), reason)
        for product, reason in products
    ]


def _promoted(elements: list[Element], notes: list[str]) -> list[Element]:
    """Make components of elements of unknown class where a file has no others (infrastructure, plain exports)."""
    unknown = [element.ifc_class in UNKNOWN and element.role is Role.FITTING for element in elements]
    if any(element.role is Role.COMPONENT for element in elements):
        if any(unknown):
            notes.append(
                f"elements of unknown class (proxies) taken for fittings: {sum(unknown)}; select them to lift them"
            )
        return elements
    if not any(unknown):
        notes.append("no element is of a class that is lifted: select what to lift")
        return elements
    notes.append(f"no element is of a class that is lifted; of unknown class (proxies), so lifted: {sum(unknown)}")
    return [
        replace(element, role=Role.COMPONENT) if is_unknown else element
        for element, is_unknown in zip(elements, unknown, strict=True)
    ]


def _without_small_parts(elements: list[Element], notes: list[str]) -> list[Element]:
    """Make fittings of components that a hand carries: detailed models hold nuts and anchors as ``IfcBeam``."""
    light = [element.role is Role.COMPONENT and element.mass_kg < HAND_CARRIED_KG for element in elements]
    if not any(light) or sum(light) == sum(element.role is Role.COMPONENT for element in elements):
        return elements
    notes.append(f"parts under {HAND_CARRIED_KG:g} kg taken for fittings: {sum(light)}; select them to lift them")
    return [
        replace(element, role=Role.FITTING) if is_light else element
        for element, is_light in zip(elements, light, strict=True)
    ]
