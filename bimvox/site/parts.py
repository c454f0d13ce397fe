"""Components from elements, their cells and the site file: shape, place, hook and storage."""

from __future__ import annotations

import graphlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from bimvox.bim.building import Element, Role, TriangleMesh
from bimvox.bim.kinds.kind import OUT
from bimvox.grid.frame import GridFrame
from bimvox.site.component import NO_HINTS, Component, IntVec, OrderHints, StoredPose, shape_of
from bimvox.site.config.site_config import ComponentConfig, SiteConfig
from bimvox.site.config.validation import nearest
from bimvox.site.means import LIFTED, Means, Reasoned
from bimvox.site.work import kind_of

_DIRECTIONS = 36
_LYING = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])


def sail_area_m2(mesh: TriangleMesh, *, tipped: bool = False) -> float:
    """Return the largest area that a part presents to a horizontal wind from any direction, m2.

    Per wind direction (every 5 degrees; opposite ones are the same) it is the smaller of two upper bounds of the
    outline's area: the projected area of all faces, and that of the convex hull (smaller for parts with many inner
    faces). A closed surface covers its outline twice, so half of its projected area counts (exact for convex parts).

    Args:
        mesh: The part in its orientation in the building; metres.
        tipped: Whether it is upended: then its area while it lies counts too.
    """
    areas = [float(sail_areas_m2(mesh.triangles_m, mesh.vertices_m).max(initial=0.0))]
    if tipped:
        areas.append(float(sail_areas_m2(mesh.triangles_m @ _LYING.T, mesh.vertices_m @ _LYING.T).max(initial=0.0)))
    return max(areas)


def sail_areas_m2(triangles_m: NDArray[np.float64], vertices_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (N,) the area that (M, 3, 3) triangles present to a wind from each of N directions over half a turn."""
    angles = np.arange(_DIRECTIONS) * (np.pi / _DIRECTIONS)
    along = np.stack([np.cos(angles), np.sin(angles), np.zeros(_DIRECTIONS)], axis=1)
    shown = _shown(triangles_m, along) * (1.0 if _is_closed(triangles_m) else 2.0)
    try:
        hull = ConvexHull(vertices_m)
    except QhullError:  # a flat part has no hull: its faces are exact
        return shown
    return np.minimum(shown, _shown(vertices_m[hull.simplices], along))


def _is_closed(triangles_m: NDArray[np.float64]) -> bool:
    """Return whether an even number of (N, 3, 3) triangles meets at every edge: then every line crosses them evenly."""
    _, corners = np.unique(triangles_m.reshape(-1, 3), axis=0, return_inverse=True)
    edges = np.sort(corners.reshape(-1, 3)[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    _, counts = np.unique(edges[edges[:, 0] != edges[:, 1]], axis=0, return_counts=True)
    return not (counts % 2).any()


def _shown(triangles_m: NDArray[np.float64], along: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (D,) half the projected area of (N, 3, 3) triangles per direction: a closed surface counts it twice."""
    normals = 0.5 * np.cross(triangles_m[:, 1] - triangles_m[:, 0], triangles_m[:, 2] - triangles_m[:, 0])
    half: NDArray[np.float64] = 0.5 * np.abs(normals @ along.T).sum(axis=0)
    return half


def order_hints(
    config: SiteConfig, elements: Sequence[Element], first: frozenset[str], connections: Sequence[tuple[str, str]]
) -> Mapping[str, OrderHints]:
    """Return the hints of every component. Tasks of a programme take the place of those in the building file.

    ``first``: ids of those that the site file asks for first; ``connections``: pairs of ids that the building file
    connects.
    """
    programme = config.programme
    zones = [zone for zone in config.zone if zone.kind == "assembly"]
    polygons = [shapely.Polygon(zone.polygon) for zone in zones]
    heights = sorted({e.storey_height_m for e in elements if e.storey_height_m is not None})
    rank = {height: n for n, height in enumerate(heights)}
    partners: dict[str, set[str]] = {}
    for one, other in connections:
        partners.setdefault(one, set()).add(other)
        partners.setdefault(other, set()).add(one)
    hints = {}
    for element in elements:
        centre = shapely.Point(*(float(v) for v in np.mean(element.mesh.bounds_m, axis=0)[:2]))
        zone = next((n for n, polygon in enumerate(polygons) if polygon.covers(centre)), None)
        by_storey = config.sequence.storeys and element.storey_height_m is not None
        by_task = config.sequence.schedule
        task: tuple[str | None, int | None] = (element.task, element.task_rank)
        if programme is not None:
            set_by = programme.task_of(element)
            task = (None, None) if set_by is None else (set_by.name, set_by.rank)
        hints[element.id] = OrderHints(
            first=element.id in first,
            zone=zone,
            zone_name=None if zone is None else zones[zone].name or f"assembly zone {zone + 1}",
            task=task[0] if by_task else None,
            task_rank=task[1] if by_task else None,
            storey_rank=rank[element.storey_height_m] if by_storey and element.storey_height_m is not None else None,
            assembly=element.assembly,
            connected=tuple(sorted(partners.get(element.id, ()))),
            rank=getattr(config.sequence.ranks, kind_of(element)) if config.sequence.storeys else None,
        )
    return hints


_UPRIGHT_CLASSES = frozenset({"IfcColumn", "IfcMember", "IfcPile", "Mesh"})
_SLENDER = 2.0
_ASIDE_VOX = 0.4999
"""A hook on the border of two cells is kept this little inside its own, so that rounding finds the same cell."""


def entries_by_id(config: SiteConfig, elements: Iterable[Element]) -> dict[str, ComponentConfig]:
    """Return the site file's ``[[component]]`` tables by element id, with before and after as element ids.

    What they leave out of the plan has none.

    Raises:
        ConfigError: If an id matches no component or several, or if before and after contradict each other.
    """
    every = list(elements)
    components = [element for element in every if element.role is Role.COMPONENT]
    entries: dict[str, ComponentConfig] = {}
    for number, entry in enumerate(config.component):
        key = f"component[{number}]"
        if entry.means == OUT:
            _find(config, f"{key}.global_id", entry.global_id, every)
            continue
        found = _find(config, f"{key}.global_id", entry.global_id, components)
        before = tuple(_find(config, f"{key}.before", name, components) for name in entry.before)
        after = tuple(_find(config, f"{key}.after", name, components) for name in entry.after)
        entries[found] = entry.model_copy(update={"before": before, "after": after})
    sorter: graphlib.TopologicalSorter[str] = graphlib.TopologicalSorter()
    for element_id, entry in entries.items():
        sorter.add(element_id, *entry.after)
        for later in entry.before:
            sorter.add(later, element_id)
    try:
        sorter.prepare()
    except graphlib.CycleError as error:
        raise config.error("component", f"before and after form a cycle: {' -> '.join(error.args[1])}") from None
    pinned = {element_id for element_id, entry in entries.items() if entry.pinned}
    for number, (_, entry) in enumerate(entries.items()):
        for name in (*entry.before, *entry.after):
            if name in pinned:
                raise config.error(f"component[{number}]", f"{name!r} is pinned, so it is not part of the order")
    return entries


def first_ids(config: SiteConfig, elements: Iterable[Element]) -> frozenset[str]:
    """Return the element ids of the components that the site file asks for first.

    Raises:
        ConfigError: If an id matches no component or several.
    """
    components = [element for element in elements if element.role is Role.COMPONENT]
    return frozenset(
        _find(config, f"sequence.first[{n}]", name, components) for n, name in enumerate(config.sequence.first)
    )


def component_of(
    index: int,
    element: Element,
    cells: NDArray[np.int32],
    entry: ComponentConfig | None,
    frame: GridFrame,
    hints: OrderHints = NO_HINTS,
    means: Reasoned = LIFTED,
) -> Component:
    """Return the component of an element.

    Args:
        index: Its position in the site's components.
        element: In the site frame.
        cells: (N, 3) int32 grid cells that it occupies, N >= 1.
        entry: Its table in the site file.
        frame: Frame of the grid.
        hints: Its order hints.
        means: How it gets to its place, and why.
    """
    shape, target_vox = shape_of(cells)
    stored = stored_as(element, entry, frame)
    hook_vox, aside_vox = _hook(element.mesh, target_vox, shape.size_vox, frame, shape.cells)
    return Component(
        index=index,
        id=element.id,
        global_id=element.global_id,
        ifc_class=element.ifc_class,
        name=element.name,
        shape=shape,
        target_vox=target_vox,
        mesh=element.mesh,
        mass_kg=element.mass_kg,
        hook_offset_vox=hook_vox,
        erected=stored.erected,
        start_vox=stored.start_vox,
        stored_pose=stored.stored_pose,
        before=stored.before,
        after=stored.after,
        type_name=element.type_name,
        storey=element.storey,
        material=element.material,
        mass_source=element.mass_source,
        hints=hints,
        stored_turn=stored.stored_turn,
        predefined_type=element.predefined_type,
        sail_area_m2=round(sail_area_m2(element.mesh, tipped=stored.erected), 6),
        means=means.means,
        means_reason=means.why,
        casting=element.casting,
        judgement=element.judgement,
        hook_aside_vox=aside_vox,
        volume_guessed=element.volume_guessed,
        doubted_kg=element.doubted_kg,
        stated_means=None if element.stated_means is None else Means(element.stated_means),
    )


@dataclass(frozen=True, slots=True)
class _StoredAs:
    """What the site file says of a component, and whether it is upended; the fields are those of ``Component``."""

    start_vox: IntVec | None
    stored_pose: StoredPose | None
    stored_turn: int | None
    before: tuple[str, ...]
    after: tuple[str, ...]
    erected: bool


def stored_as(element: Element, entry: ComponentConfig | None, frame: GridFrame) -> _StoredAs:
    """Return how a component is stored, and its place in the order, as the site file says.

    ``entry``: its table in the site file, from `entries_by_id`.
    """
    if entry is None:
        return _StoredAs(None, None, None, (), (), is_erected(element))
    if entry.flip == "two_hooks" and entry.pose is None and not is_erected(element):
        # Turned by a quarter in this pose, it would lie on its edge.
        entry = entry.model_copy(update={"pose": _flat(element), "turn": entry.turn or 0})
    start_vox: IntVec | None = None
    if entry.start is not None:
        x, y, z = (int(n) for n in frame.cell_of((*entry.start, 0.0)[:3]))
        start_vox = (x, y, z)
    erected = is_erected(element) and not entry.turn if entry.pose is None else entry.pose is not StoredPose.AS_BUILT
    return _StoredAs(start_vox, entry.pose, entry.turn, entry.before, entry.after, erected)


def _flat(element: Element) -> StoredPose:
    """Return the pose in which an upright panel lies flat."""
    x_m, y_m, _ = np.ptp(element.mesh.bounds_m, axis=0)
    return StoredPose.LYING_X if x_m < y_m else StoredPose.LYING_Y


def is_erected(element: Element) -> bool:
    """Return whether a part is delivered lying down: slender columns, members, piles and mesh bodies.

    Slender: at least twice as high as the longer side on plan.
    """
    size = np.ptp(element.mesh.bounds_m, axis=0)
    return element.ifc_class in _UPRIGHT_CLASSES and bool(size[2] >= _SLENDER * max(size[0], size[1]) - 1e-9)


def centre_of_mass_m(mesh: TriangleMesh) -> NDArray[np.float64] | None:
    """Return the (3,) centroid of the volume that a mesh encloses; None if it encloses none.

    Signed tetrahedra from a point near the mesh (divergence theorem); exact for closed meshes of either orientation.
    """
    near = mesh.bounds_m.mean(axis=0)
    a, b, c = np.moveaxis(mesh.triangles_m - near, 1, 0)
    volumes = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6.0
    total = float(volumes.sum())
    if abs(total) <= 1e-6 * float(np.prod(np.maximum(np.ptp(mesh.bounds_m, axis=0), 1e-3))):
        return None
    centre: NDArray[np.float64] = near + (volumes[:, None] * (a + b + c) / 4.0).sum(axis=0) / total
    return centre


def _hook(
    mesh: TriangleMesh, target_vox: IntVec, size_vox: IntVec, frame: GridFrame, cells: NDArray[np.int32]
) -> tuple[IntVec, tuple[float, float]]:
    """Return the hook's cell, one above the top in the column above the centre of mass, and its place in that column.

    The column is inside the bounding box. Without a volume, it is the middle of the cells.
    """
    centre_m, most = centre_of_mass_m(mesh), np.array(size_vox[:2])
    if centre_m is None:
        x, y = (int(n) for n in np.clip(np.floor(cells.mean(axis=0) + 0.5)[:2], 0, most - 1))
        return (x, y, size_vox[2]), (0.0, 0.0)
    x, y = (int(n) for n in np.clip((frame.cell_of(centre_m) - np.array(target_vox))[:2], 0, most - 1))
    at = (centre_m - np.array(frame.origin_m))[:2] / frame.voxel_size_m - target_vox[:2]
    aside = np.clip(at - np.array([x, y]) - 0.5, -_ASIDE_VOX, _ASIDE_VOX)
    # A log does not keep the sign of zero, which the digest of a site would see.
    return (x, y, size_vox[2]), (round(float(aside[0]), 9) + 0.0, round(float(aside[1]), 9) + 0.0)


def _find(config: SiteConfig, key: str, name: str, components: Sequence[Element]) -> str:
    """Return the id of the one component with the id or GlobalId ``name``."""
    if any(element.id == name for element in components):
        return name
    found = [element.id for element in components if element.global_id == name]
    if len(found) == 1:
        return found[0]
    if found:
        raise config.error(key, f"{name!r} is the GlobalId of several parts", available=found, hint=f"use {found[0]!r}")
    known: Mapping[str, str] = {element.id: element.name for element in components}
    near = nearest(name, tuple(known))
    raise config.error(
        key,
        f"no component has the id {name!r}",
        available=tuple(known),
        hint=f"did you mean {near!r}?" if near else None,
    )
