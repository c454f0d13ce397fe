"""Components from elements, their cells and the site file: shape, place, hook and storage."""

from __future__ import annotations

import graphlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bimvox.bim.building import Element, Role, TriangleMesh
from bimvox.bim.kinds.correction import OUT
from bimvox.grid.frame import GridFrame
from bimvox.site.component import NO_HINTS, Component, IntVec, OrderHints, StoredPose
from bimvox.site.config.site_config import ComponentConfig, SiteConfig
from bimvox.site.config.validation import nearest
from bimvox.site.means import LIFTED, Means, Reasoned
from bimvox.site.sail import sail_area_m2
from bimvox.site.shape import shape_of

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
        stated_means=None if element.stated_means is None else Means(element.stated_means),
    )


@dataclass(frozen=True, slots=True)
class StoredAs:
    """What the site file says of a component, and whether it is upended; the fields are those of ``Component``."""

    start_vox: IntVec | None
    stored_pose: StoredPose | None
    stored_turn: int | None
    before: tuple[str, ...]
    after: tuple[str, ...]
    erected: bool


def stored_as(element: Element, entry: ComponentConfig | None, frame: GridFrame) -> StoredAs:
    """Return how a component is stored, and its place in the order, as the site file says.

    Args:
        element: In the site frame.
        entry: Its table in the site file, from `entries_by_id`.
        frame: Frame of the grid.
    """
    if entry is None:
        return StoredAs(None, None, None, (), (), is_erected(element))
    start_vox: IntVec | None = None
    if entry.start is not None:
        x, y, z = (int(n) for n in frame.cell_of((*entry.start, 0.0)[:3]))
        start_vox = (x, y, z)
    erected = is_erected(element) and not entry.turn if entry.pose is None else entry.pose is not StoredPose.AS_BUILT
    return StoredAs(start_vox, entry.pose, entry.turn, entry.before, entry.after, erected)


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
