"""Read an IFC file into a building: from products to meshes, elements and roles."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import BUILT, Building, Role, SkippedProduct, Source, TriangleMesh, part_name
from bimvox.bim.ifc.answer import PlacedShape, shape_groups
from bimvox.bim.ifc.assembly import Extent, MeshedProduct
from bimvox.bim.ifc.class_roles import TOO_SMALL, by_default, reason_not_solid, reason_too_small, role_of_class
from bimvox.bim.ifc.elements import ElementBuilder, ProductCorrections
from bimvox.bim.ifc.endless import endless_products, largely_curved, named_misfit
from bimvox.bim.ifc.geometry import GeometryPool
from bimvox.bim.ifc.open import OpenedIfc, open_ifc
from bimvox.bim.ifc.properties import Properties
from bimvox.bim.ifc.relations import schedule_starts_on, stated_terrain_m, storeys_of
from bimvox.bim.ifc.text import label
from bimvox.bim.ifc.units import georeference_of
from bimvox.bim.options import ReadOptions
from bimvox.bim.site_frame import local_origin, placed_twice
from bimvox.errors import IfcError, InputError, SelectionError, listed, shown
from bimvox.progress import Report


def read_ifc(
    path: Path, data: bytes, sha256: str, options: ReadOptions, report: Report, pool: GeometryPool
) -> Building:
    """Return the building in an IFC file.

    Args:
        path: The file; the pool reads it as well.
        data: Its bytes.
        sha256: Their hash.
        options: What to lift and how.
        report: Called with the progress.
        pool: Geometry workers, already starting.

    Raises:
        IfcError: If the file cannot be used or contains nothing solid.
        SelectionError: If the query is malformed or selects nothing solid.
        InputError: If the requested unit contradicts the file.
    """
    report("open", 0, 1)
    opened = open_ifc(path, data)
    if options.unit is not None and options.unit != opened.unit:
        raise InputError(f"{path}: states its own unit ({opened.unit}), not {options.unit}", hint="leave unit out")
    selected = None if options.select is None else pool.select(options.select)
    corrections = ProductCorrections(options.corrections, pool.select_each)
    report("open", 1, 1)
    with named_misfit(path, opened.file):
        return _building(opened, path, sha256, options, report, pool, selected, corrections)


def _building(
    opened: OpenedIfc,
    path: Path,
    sha256: str,
    options: ReadOptions,
    report: Report,
    pool: GeometryPool,
    selected: frozenset[int] | None,
    corrections: ProductCorrections,
) -> Building:
    """Return the building in an opened file; ``selected`` holds step ids, None for the default selection."""
    notes = list(opened.notes)
    wanted, skipped = _sort_out(opened, corrections.step_ids | (selected or frozenset()), notes)
    endless = endless_products(opened.file, opened.outlines, wanted)
    skipped.update({step_id: endless[step_id] for step_id in wanted if step_id in endless})
    wanted = [step_id for step_id in wanted if step_id not in endless]
    properties = Properties()
    groups = shape_groups(opened.file, wanted)
    meshed = pool.mesh(
        groups,
        lambda done: report("geometry", done, len(wanted)),
        plain=largely_curved(opened.file, opened.metres_per_unit),
        meanwhile=(properties.sets_of(opened.file.by_id(step_id)) for step_id in wanted),
    )
    skipped.update({step_id: _why(opened.file.by_id(step_id), why) for step_id, why in meshed.failures.items()})
    notes += _without_body(opened, {**endless, **meshed.failures})
    if meshed.retried:
        notes.append(f"products that needed a second geometry library: {len(meshed.retried)}")

    origin_m = local_origin([_box(placed.mesh(np.zeros(3))) for placed in meshed.shapes.values()])
    parts = {step_id: _part(meshed.shapes[step_id], origin_m) for step_id in sorted(meshed.shapes)}
    notes += _repairs(meshed.shapes.values())
    if not parts:
        reasons = "; ".join(f"{count} x {reason}" for reason, count in Counter(skipped.values()).most_common(3))
        raise IfcError(
            path, f"holds nothing solid ({reasons or 'no product has geometry'})", hint="export it with 3D bodies"
        )
    builder = ElementBuilder(opened, parts, selected, properties, origin_m, corrections)
    lifts, repeated = builder.groups(options.assemblies)
    skipped.update(repeated)
    elements = []
    for index, group in enumerate(lifts):
        elements.append(builder.element(group))
        report("elements", index + 1, len(lifts))
    notes += [*builder.notes(), *corrections.notes()]
    elements = by_default(elements, notes) if selected is None else elements
    if selected is not None and not any(element.role is Role.COMPONENT for element in elements):
        raise SelectionError(
            f"select {shown(options.select)}: matches {len(selected)} products, none of them solid",
            hint="select columns, beams, walls, slabs or other elements with a body",
        )
    georeference = georeference_of(opened.file, opened.metres_per_unit)
    bounds = np.array([element.mesh.bounds_m for element in elements])
    middle_m = origin_m + (bounds[:, 0].min(axis=0) + bounds[:, 1].max(axis=0)) / 2.0
    if (note := placed_twice(georeference, middle_m)) is not None:
        notes.append(note)
    return Building(
        elements=tuple(elements),
        skipped=tuple(_skipped(opened.file, skipped)),
        source=Source(path.name, sha256, opened.schema, opened.unit),
        origin_m=origin_m,
        georeference=georeference,
        notes=tuple(notes),
        connections=builder.connections(),
        storeys=storeys_of(opened.file, opened.metres_per_unit),
        terrain_m=stated_terrain_m(opened.file, opened.metres_per_unit),
        starts_on=schedule_starts_on(opened.file),
        written_on=opened.written_on,
    )


def _sort_out(opened: OpenedIfc, named: frozenset[int], notes: list[str]) -> tuple[list[int], dict[int, str]]:
    """Return the step ids to mesh, ascending, and for every other product with a representation why it is skipped.

    ``named``: products that somebody selected, which are never too small.
    """
    wanted, skipped = [], {}
    for product in opened.file.by_type("IfcProduct"):
        if product.Representation is None:
            continue
        step_id, ifc_class = product.id(), product.is_a()
        reason = reason_not_solid(opened.schema, ifc_class)
        if reason is None and step_id not in named:
            reason = reason_too_small(opened.schema, ifc_class)
        if reason is None and role_of_class(opened.schema, ifc_class) is None:
            reason = "not a building element"
        if reason is None:
            wanted.append(step_id)
        else:
            skipped[step_id] = reason
    small = [step_id for step_id, reason in skipped.items() if reason in TOO_SMALL.values()]
    if small and not wanted:
        notes.append(f"only products that come inside or on other parts, so these were read: {len(small)} products")
        wanted, skipped = small, {step_id: why for step_id, why in skipped.items() if why not in TOO_SMALL.values()}
    return sorted(wanted), skipped


def _part(placed: PlacedShape, origin_m: NDArray[np.float64]) -> MeshedProduct:
    """Return a shape, placed relative to the local origin."""
    mesh = placed.mesh(origin_m)
    low_m, high_m = _box(mesh)
    solid = placed.shape.solid
    return MeshedProduct(mesh, Extent(low_m, high_m, solid.volume_m3), solid)


def _box(mesh: TriangleMesh) -> NDArray[np.float64]:
    """Return the (2, 3) box of a mesh whose vertices are all used."""
    return np.stack([mesh.vertices_m.min(axis=0), mesh.vertices_m.max(axis=0)])


def _repairs(placed: Collection[PlacedShape]) -> list[str]:
    """Return notes on repairs."""
    notes = []
    if dropped := sum(one.shape.dropped for one in placed):
        notes.append(f"triangles without area dropped: {dropped}")
    if turned := sum(one.shape.turned for one in placed):
        notes.append(f"inside-out products turned outward: {turned}")
    return notes


def _without_body(opened: OpenedIfc, reasons: Mapping[int, str]) -> list[str]:
    """Return notes, by reason, on the products that would be lifted or be in the way, but have no usable body."""
    names: dict[str, list[str]] = {}
    for step_id, reason in sorted(reasons.items()):
        product = opened.file.by_id(step_id)
        if role_of_class(opened.schema, product.is_a()) in BUILT:
            names.setdefault(reason, []).append(part_name(str(product.GlobalId), label(product.Name)))
    return [
        f"{len(every)} {'products are' if len(every) > 1 else 'product is'} left out, because the model has no usable "
        f"body of {'them' if len(every) > 1 else 'it'}: {listed(every, most=5)}; {reason}"
        for reason, every in names.items()
    ]


def _why(product: Any, reason: str) -> str:
    """Return a kernel's failure, with the representations that the product has."""
    shown = [item.RepresentationIdentifier for item in getattr(product.Representation, "Representations", ())]
    return f"{reason}; its representations: {', '.join(str(name) for name in shown)}" if shown else reason


def _skipped(file: Any, reasons: Mapping[int, str]) -> list[SkippedProduct]:
    """Return the skipped products in file order."""
    products = [(file.by_id(step_id), reasons[step_id]) for step_id in sorted(reasons)]
    return [
        SkippedProduct(str(product.GlobalId), product.is_a(), label(product.Name), reason)
        for product, reason in products
    ]
