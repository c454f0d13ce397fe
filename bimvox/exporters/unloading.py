"""The deliveries of a plan as sites of their own: the crane unloads a truck, one part after the other, into the yard.

Each delivery becomes a site file with a model, which ``bimvox plan`` plans, times and proves like any other. Its parts
lie on the truck and their places are those in the yard; what the plan has set before stands. A loaded truck fills the
access up to the height that the road permits; every part is picked at that height, so nothing on the truck is in the
way of its path. What lies lower on the truck has a longer hoist than that. The dunnage in a stack comes with the part
that lies on it.
"""

from __future__ import annotations

import uuid
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import ifcopenshell
import ifcopenshell.guid
import numpy as np
import shapely
from numpy.typing import NDArray

from bimvox.bim.building import TriangleMesh
from bimvox.errors import InputError
from bimvox.grid.frame import whole_cells
from bimvox.log.plan_log import PlanLog
from bimvox.records.lift import Lift, YardPlace
from bimvox.site.checks import unloading_columns
from bimvox.site.component import Component, StoredPose
from bimvox.site.config.calendar import CalendarConfig
from bimvox.site.config.site_config import (
    AreasConfig,
    ComponentConfig,
    GridConfig,
    ModelConfig,
    PolicyConfig,
    SequenceConfig,
    SiteConfig,
)
from bimvox.site.config.template import site_toml
from bimvox.site.site import Site

TRUCK_HEIGHT_M: Final = 4.0
"""The highest loaded vehicle without a permit (Directive 96/53/EC)."""
_BEARER_M = 0.1
"""Width of a bearer; assumed."""
_TRUCK = "truck"


@dataclass(frozen=True, slots=True, eq=False)
class _DeliverySite:
    """The site of a delivery.

    Attributes:
        number: Number of the delivery, from 1.
        files: Its files by name: site file, model, machines.
        parts: How many parts are unloaded.
        nowhere: Labels of the parts that the crane can pick at no place of the access.
    """

    number: int
    files: Mapping[str, bytes]
    parts: int
    nowhere: tuple[str, ...]


def delivery_sites(log: PlanLog, config: SiteConfig) -> tuple[_DeliverySite, ...]:
    """Return the sites of all deliveries of a plan, in order.

    The log is whole; the site file is complete, in the site's frame.

    Raises:
        InputError: If the site has no access or no crane.
    """
    site = log.plan.site
    if site.access is None or not site.cranes:
        raise InputError(
            "the site has no access of trucks, or no crane, so nothing says where a truck is unloaded",
            hint="give [areas] access in the site file, and plan again",
        )
    loads: dict[int, list[Lift]] = {}
    for lift in log.all_lifts:
        if lift.in_yard is not None:
            loads.setdefault(lift.in_yard.delivery, []).append(lift)
    return tuple(_delivery_site(log, config, number, load) for number, load in sorted(loads.items()))


def _delivery_site(log: PlanLog, config: SiteConfig, number: int, load: Sequence[Lift]) -> _DeliverySite:
    """Return the site of one delivery; ``load`` are its lifts in order."""
    site = log.plan.site
    first = load[0].order
    name = f"{site.name}-delivery-{number + 1}"
    standing = [
        Body(one.id, one.label, one.ifc_class, one.mesh)
        for lift in log.all_lifts
        if lift.order < first and lift.is_set
        for one in (site.components[lift.component],)
    ]
    standing += [Body(one.id, one.id, "", one.mesh) for one in site.blockers if one.kind == "structure" and one.mesh]
    top = whole_cells(TRUCK_HEIGHT_M, site.frame.voxel_size_m)
    height_m = top * site.frame.voxel_size_m
    for at, polygon in enumerate(config.areas.access or ()):
        standing.append(Body(f"{_TRUCK} {at + 1}", f"{_TRUCK} {at + 1}", "", _prism(polygon, 0.0, height_m)))
    bodies: list[Body] = []
    entries: list[ComponentConfig] = []
    nowhere: list[str] = []
    for lift in reversed(load):  # what is lifted first lies on top
        component, place = site.components[lift.component], lift.in_yard
        assert place is not None
        mesh = _on_dunnage(site, load, component, place)
        body = Body(component.id, component.name or component.id, component.ifc_class, mesh, component.mass_kg)
        start = _start(site, component, place, top)
        if start is None:
            nowhere.append(component.label)
            continue
        (x, y, z), turn = start
        entries.append(
            ComponentConfig(
                global_id=body.global_id,
                start=(x, y, z),
                pose=StoredPose.AS_BUILT,
                turn=turn,
                after=tuple(one.global_id for one in bodies[-1:]),
                crane=site.cranes[component.crane].name if site.has_several_cranes else None,
                setup=None if site.moving is None else site.moving.names[component.crane],
                means="crane",
            )
        )
        bodies.append(body)
    low_m, high_m = site.frame.corner_of([0, 0, 0]).tolist(), site.frame.corner_of(site.shape).tolist()
    own = config.model_copy(
        update={
            "name": name,
            "coordinates": "site",
            "model": ModelConfig(
                path=Path(f"{name}.ifc"), select=_SELECT_LIFTED, voxel_size_m=site.frame.voxel_size_m, ground_m=0.0
            ),
            "grid": GridConfig(low_m=tuple(low_m[:2]), high_m=tuple(high_m)),
            "areas": AreasConfig(construction=config.areas.construction, yard=config.areas.access),
            "component": tuple(entries),
            "zone": tuple(zone for zone in config.zone if zone.kind != "assembly"),
            "sequence": SequenceConfig(storeys=False, schedule=False),
            "rules": config.rules.model_copy(update={"bracing_s": 0.0, "curing": None}),
            "yard": None,
            "calendar": CalendarConfig(),
            "policy": PolicyConfig(),
        }
    )
    files = {f"{name}.site.toml": site_toml(own).encode(), f"{name}.ifc": model_ifc(name, [*bodies, *standing])}
    files |= config.machine_files
    return _DeliverySite(number + 1, files, len(bodies), tuple(nowhere))


def _stored(site: Site, component: Component, place: YardPlace) -> TriangleMesh:
    """Return the triangles of a part as it lies in the yard; its lowest point is on the floor of its lowest cell."""
    size_m = site.frame.voxel_size_m
    width, depth = (size_m * n for n in component.shape.size_vox[:2])
    x, y, z = (component.mesh.vertices_m - site.frame.corner_of(component.target_vox)).T
    for _ in range(place.turn):
        x, y, width, depth = depth - y, x, depth, width
    if place.pose is StoredPose.LYING_X:
        x, z = z, width - x
    elif place.pose is StoredPose.LYING_Y:
        y, z = z, depth - y
    used = np.unique(component.mesh.faces)
    vertices_m = np.stack([x, y, z - z[used].min()], axis=1) + site.frame.corner_of(place.cell_vox)
    return TriangleMesh(vertices_m, component.mesh.faces)


def _on_dunnage(site: Site, load: Sequence[Lift], component: Component, place: YardPlace) -> TriangleMesh:
    """Return the triangles of a part as it lies in the yard; in a stack, with two bearers down to the part below."""
    mesh = _stored(site, component, place)
    below = [
        _stored(site, site.components[lift.component], under).bounds_m[1, 2]
        for lift in load
        if place.stack and (under := lift.in_yard) is not None
        if under.stack == place.stack and under.cell_vox[2] < place.cell_vox[2]
    ]
    if not below:
        return mesh
    low, high = mesh.bounds_m
    along = int(np.argmax((high - low)[:2]))
    bearers = []
    for share in (0.2, 0.8):
        middle_m = float(low[along] + share * (high[along] - low[along]))
        ends = np.array([low[:2], high[:2]])
        ends[:, along] = middle_m - _BEARER_M / 2.0, middle_m + _BEARER_M / 2.0
        (x0, y0), (x1, y1) = ends.tolist()
        bearers.append(_prism([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], max(below), float(low[2])))
    return TriangleMesh.joined([mesh, *bearers])


def _start(
    site: Site, component: Component, place: YardPlace, top_vox: int
) -> tuple[tuple[float, float, float], int] | None:
    """Return the lowest corner of a part on the truck, and its quarter turns; None if it can be picked nowhere.

    It lies along the truck if there is room, at the place nearest to that in the yard.
    """
    assert site.access is not None
    columns = np.argwhere(site.access)
    along = int(np.argmax(np.ptp(columns, axis=0)))
    sizes = place.shape.size_vox[:2]
    lies_along = sizes[along] >= sizes[1 - along]
    able = np.zeros(site.shape[:2], np.bool_)
    able[tuple(unloading_columns(site, component).T)] = True
    goal = np.array(place.cell_vox[:2]) + np.array(sizes) / 2.0
    for turn in (0, 1) if lies_along else (1, 0):
        size = np.array(sizes if turn == 0 else sizes[::-1])
        free = columns[_covered(site.access, columns, size)]
        free = free[able[tuple((free + size // 2).T)]]
        if len(free):
            nearest = free[int(np.argmin(np.hypot(*(free + size / 2.0 - goal).T)))]
            x, y, z = site.frame.corner_of([*nearest.tolist(), 1 + top_vox]).tolist()
            return (x, y, z), turn
    return None


def _covered(area: NDArray[np.bool_], corners: NDArray[np.int64], size: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return (N,) whether rectangles of a size in columns, by their lowest corners, lie wholly in an area."""
    table = np.zeros(np.array(area.shape) + 1, np.int64)
    table[1:, 1:] = area.cumsum(axis=0).cumsum(axis=1)
    inside = (corners + size <= area.shape).all(axis=1)
    (x0, y0), (x1, y1) = corners.T, np.minimum(corners + size, area.shape).T
    count = table[x1, y1] - table[x0, y1] - table[x1, y0] + table[x0, y0]
    covered: NDArray[np.bool_] = inside & (count == size.prod())
    return covered


def _prism(corners: Sequence[tuple[float, float]], low_m: float, high_m: float) -> TriangleMesh:
    """Return an upright prism over a polygon, between two heights."""
    polygon = shapely.Polygon(corners)
    ring = np.array((polygon if polygon.exterior.is_ccw else polygon.reverse()).exterior.coords)[:-1]
    number = {(x, y): n for n, (x, y) in enumerate(ring.tolist())}
    flat = [
        [number[x, y] for x, y in np.array(one.exterior.coords)[:3].tolist()]
        for one in shapely.constrained_delaunay_triangles(polygon).geoms
    ]
    upward = np.array([face if _is_left(ring[face]) else face[::-1] for face in flat])
    here = np.arange(len(ring))
    after = np.roll(here, -1)
    above, above_after = here + len(ring), after + len(ring)
    sides = [np.stack([here, after, above_after], axis=1), np.stack([here, above_after, above], axis=1)]
    floor, roof = (np.column_stack([ring, np.full(len(ring), z)]) for z in (low_m, high_m))
    faces = np.concatenate([upward[:, ::-1], upward + len(ring), *sides]).astype(np.int32)
    return TriangleMesh(np.concatenate([floor, roof]), faces)


def _is_left(corners: NDArray[np.float64]) -> bool:
    """Return whether a triangle on plan is counter-clockwise."""
    (ax, ay), (bx, by), (cx, cy) = corners
    return bool((bx - ax) * (cy - ay) > (by - ay) * (cx - ax))


# A small IFC4 model of bodies: parts to be lifted, and what stands already.
#
# The same bodies give the same bytes. Lengths are metres, masses kilograms.

_LIFTED: Final = "lifted"
"""The tag of the parts that are to be lifted."""
_SELECT_LIFTED: Final = f'IfcElement, Tag="{_LIFTED}"'
"""The query that selects them."""
_NAMESPACE = uuid.UUID("2f6a1f0b-7c0e-5b53-8f6e-9d0a4c5e8b21")
_ANY = "IfcBuildingElementProxy"


@dataclass(frozen=True, slots=True, eq=False)
class Body:
    """One product of a model.

    Attributes:
        id: Unique among the bodies; its GlobalId follows from it unless it is one.
        name: Its name.
        ifc_class: Its class; a proxy if IFC4 has no such class of elements, or if it stands already.
        mesh: Its triangles, metres.
        mass_kg: Its mass; None if it stands already.
    """

    id: str
    name: str
    ifc_class: str
    mesh: TriangleMesh
    mass_kg: float | None = None

    @property
    def global_id(self) -> str:
        """The GlobalId in the file."""
        try:
            ifcopenshell.guid.expand(self.id)
        except (ValueError, KeyError, TypeError):
            return _guid(self.id)
        return self.id if len(self.id) == 22 else _guid(self.id)


def model_ifc(name: str, bodies: Sequence[Body]) -> bytes:
    """Return an IFC4 file of bodies.

    Bodies with a mass are tagged ``_LIFTED``; the others are named as existing.
    """
    file: Any = ifcopenshell.file(schema="IFC4")
    file.header.file_name.time_stamp = "2024-01-01T00:00:00"

    def add(ifc_class: str, **attributes: Any) -> Any:
        return file.create_entity(ifc_class, **attributes)

    units = [
        add("IfcSIUnit", UnitType="LENGTHUNIT", Name="METRE"),
        add("IfcSIUnit", UnitType="MASSUNIT", Prefix="KILO", Name="GRAM"),
        add("IfcSIUnit", UnitType="PLANEANGLEUNIT", Name="RADIAN"),
    ]
    origin = add("IfcAxis2Placement3D", Location=add("IfcCartesianPoint", Coordinates=(0.0, 0.0, 0.0)))
    context = add(
        "IfcGeometricRepresentationContext",
        ContextIdentifier="Body",
        ContextType="Model",
        CoordinateSpaceDimension=3,
        WorldCoordinateSystem=origin,
    )
    project = add(
        "IfcProject",
        GlobalId=_guid(f"project {name}"),
        Name=name,
        RepresentationContexts=[context],
        UnitsInContext=add("IfcUnitAssignment", Units=units),
    )
    placement = add("IfcLocalPlacement", RelativePlacement=origin)
    site = add("IfcSite", GlobalId=_guid(f"site {name}"), Name=name, ObjectPlacement=placement)
    add("IfcRelAggregates", GlobalId=_guid("in the project"), RelatingObject=project, RelatedObjects=[site])
    products = []
    for body in bodies:
        corners = body.mesh.vertices_m.tolist()
        faces = add(
            "IfcTriangulatedFaceSet",
            Coordinates=add("IfcCartesianPointList3D", CoordList=corners),
            CoordIndex=(body.mesh.faces + 1).tolist(),
        )
        shape = add(
            "IfcShapeRepresentation",
            ContextOfItems=context,
            RepresentationIdentifier="Body",
            RepresentationType="Tessellation",
            Items=[faces],
        )
        product = add(
            _ANY if body.mass_kg is None else _class_of(body.ifc_class),
            GlobalId=body.global_id,
            Name=f"existing {body.name}" if body.mass_kg is None else body.name,
            ObjectPlacement=placement,
            Representation=add("IfcProductDefinitionShape", Representations=[shape]),
            Tag=None if body.mass_kg is None else _LIFTED,
        )
        products.append(product)
        if body.mass_kg is not None:
            weight = add("IfcQuantityWeight", Name="GrossWeight", WeightValue=float(body.mass_kg))
            quantities = add(
                "IfcElementQuantity", GlobalId=_guid(f"mass {body.id}"), Name="BaseQuantities", Quantities=[weight]
            )
            add(
                "IfcRelDefinesByProperties",
                GlobalId=_guid(f"has the mass {body.id}"),
                RelatedObjects=[product],
                RelatingPropertyDefinition=quantities,
            )
    add(
        "IfcRelContainedInSpatialStructure",
        GlobalId=_guid("on the site"),
        RelatedElements=products,
        RelatingStructure=site,
    )
    return bytes(file.to_string().encode("ascii", "backslashreplace"))


def _class_of(ifc_class: str) -> str:
    """Return a class of IFC4 for an element; a proxy if IFC4 has none, or only an abstract one."""
    try:
        found = ifcopenshell.ifcopenshell_wrapper.schema_by_name("IFC4").declaration_by_name(ifc_class).as_entity()
    except RuntimeError:
        return _ANY
    above, is_element = found, False
    while above is not None:
        is_element, above = is_element or above.name() == "IfcElement", above.supertype()
    return _ANY if found is None or found.is_abstract() or not is_element else ifc_class


def _guid(text: str) -> str:
    return str(ifcopenshell.guid.compress(uuid.uuid5(_NAMESPACE, text).hex))
