"""The picture of a site: ground, areas, structure, obstructions, the cranes, the building as designed."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from bimvox.grid.frame import GridFrame, Label
from bimvox.grid.voxel_grid import Part, VoxelGrid
from bimvox.planning.yard import storage_poses
from bimvox.records.lift import Lift
from bimvox.rendering import colours
from bimvox.rendering.pictures.camera import View
from bimvox.rendering.pictures.cranes import CraneParts, building_centre_m, site_cranes
from bimvox.rendering.pictures.scene import Block, Canvas, Layer, LegendEntry, Scene, Strokes, box_edges, index_type
from bimvox.rendering.words import counted
from bimvox.site.component import Component, IntVec, Rgb, Shape, stored_shape
from bimvox.site.site import Site

_AREAS = (
    (Label.GROUND, colours.GROUND, "ground"),
    (Label.CONSTRUCTION_AREA, colours.CONSTRUCTION_AREA, "construction area"),
    (Label.YARD, colours.YARD, "yard"),
)
_SIDE_DEG = 38.0
_STRAIGHT_DEG = 25.0


def scene_of_site(site: Site) -> Scene:
    """Return the picture of a site before planning, with the components at their targets."""
    canvas = site_canvas(site, len(site.components) * 2)
    legend = site_legend(site)
    strokes: list[Strokes] = []
    for component in site.components:
        canvas.paint(target_cells(component), colours.ASSEMBLED, layer=Layer.ASSEMBLED)
    legend.append(LegendEntry(f"as designed ({len(site.components)})", colours.ASSEMBLED, layer=Layer.ASSEMBLED))
    given = [component for component in site.components if component.start_vox is not None]
    for component in given:
        shape, cell = _given_place(component)
        canvas.paint(shape.cells + np.array(cell), colours.UNBUILT, layer=Layer.UNBUILT)
        strokes.append(boxes_strokes(site, [(shape, cell)], colours.START_BOX))
    if given:
        legend.append(LegendEntry(f"in the yard ({len(given)})", colours.UNBUILT, layer=Layer.UNBUILT))
    size_m = site.frame.voxel_size_m
    extent = " x ".join(f"{n * size_m:g}" for n in site.shape)
    mass_t = sum(component.mass_kg for component in site.components) / 1000.0
    caption = f"{counted(len(site.components), 'part')}, {mass_t:,.1f} t; {extent} m in cells of {size_m:g} m"
    return painted_scene(site, canvas, site_cranes(site), strokes, legend, site.name, caption)


def painted_scene(
    site: Site,
    canvas: Canvas,
    cranes: CraneParts,
    strokes: Iterable[Strokes],
    legend: Iterable[LegendEntry],
    title: str,
    caption: str,
    blocks: Sequence[Block] = (),
) -> Scene:
    """Return the scene of a painted canvas with the cranes, further lines and blocks, and text."""
    return Scene(
        frame=site.frame,
        solids=canvas.solids,
        palette=canvas.palette,
        strokes=(*cranes.strokes, *strokes),
        blocks=(*cranes.blocks, *blocks),
        legend=tuple(legend),
        title=title,
        caption=caption,
        points_m=cranes.points_m,
        layers=canvas.layers,
    )


def site_canvas(site: Site, more: int) -> Canvas:
    """Return a canvas with the fixed solids, and room for ``more``. The crane is drawn as lines, not painted."""
    canvas = Canvas(site.shape, len(_AREAS) + 2 + len(site.blockers) + more)
    slab, tops = site.labels[:, :, 0], site.ground_vox
    if tops.any():
        canvas.paint(site.blockers[0].cells, colours.GROUND, layer=Layer.GROUND)
    for label, rgb, _ in _AREAS:
        canvas.paint_columns(slab == label, tops, rgb, layer=Layer.GROUND)
    # `Site.yard` defines the yard; the labels of the slab need not repeat it.
    canvas.paint_columns(site.yard & (slab == Label.GROUND), tops, colours.YARD, layer=Layer.GROUND)
    if site.access is not None:
        canvas.paint_columns(site.access, tops, colours.ACCESS, layer=Layer.GROUND)
    for blocker in site.blockers[1:]:
        above = blocker.cells[blocker.cells[:, 2] > tops[blocker.cells[:, 0], blocker.cells[:, 1]]]
        if blocker.kind == "structure" or (blocker.kind == "crane" and not site.cranes):
            canvas.paint(above, colours.STRUCTURE, layer=Layer.STRUCTURE)
        elif blocker.kind == "obstruction":
            canvas.paint(above, colours.OBSTRUCTION, over=True, layer=Layer.OBSTRUCTIONS)
    return canvas


def site_legend(site: Site) -> list[LegendEntry]:
    """Return the legend of a site's fixed solids."""
    slab = site.labels[:, :, 0]
    there = {label: bool((slab == label).any()) for label, _, _ in _AREAS}
    there[Label.YARD] = bool(site.yard.any())
    there[Label.GROUND] = bool(((slab == Label.GROUND) & ~site.yard).any())
    legend = [LegendEntry(name, rgb, layer=Layer.GROUND) for label, rgb, name in _AREAS if there[label]]
    if site.access is not None:
        legend.append(LegendEntry("access of trucks", colours.ACCESS, layer=Layer.GROUND))
    kinds = {blocker.kind for blocker in site.blockers}
    if "structure" in kinds:
        legend.append(LegendEntry("existing structure", colours.STRUCTURE, layer=Layer.STRUCTURE))
    if "obstruction" in kinds:
        legend.append(LegendEntry("obstruction", colours.OBSTRUCTION, layer=Layer.OBSTRUCTIONS))
    return legend


def boxes_strokes(
    site: Site, places: Iterable[tuple[Shape, IntVec]], rgb: tuple[int, int, int], *, width_px: float = 2.0
) -> Strokes:
    """Return wireframe boxes around shapes at cells, a little wider so that they are visible."""
    edges = []
    grow = min(0.12 * site.frame.voxel_size_m, 0.05)
    for shape, cell in places:
        low = site.frame.corner_of(cell)
        high = site.frame.corner_of(np.array(cell) + np.array(shape.size_vox))
        edges.append(box_edges(low - grow, high + grow))
    segments = np.concatenate(edges) if edges else np.zeros((0, 2, 3))
    return Strokes(segments, rgb, width_px=width_px, hidden_opacity=0.5, layer=Layer.BOXES)


def target_cells(component: Component) -> NDArray[np.int32]:
    """Return the (N, 3) cells of a part at its place in the building."""
    cells: NDArray[np.int32] = component.shape.cells + np.array(component.target_vox, np.int32)
    return cells


def stored_cells(lift: Lift) -> NDArray[np.int32]:
    """Return the (N, 3) cells of a lift's part at its place in the yard, which it must have."""
    assert lift.place is not None
    cells: NDArray[np.int32] = lift.place.shape.cells + np.array(lift.place.cell_vox, np.int32)
    return cells


def _given_place(component: Component) -> tuple[Shape, IntVec]:
    """Return shape and cell of a component whose place the site file gives."""
    assert component.start_vox is not None
    pose = component.stored_pose or storage_poses(component)[0]
    return stored_shape(component.shape, pose, component.stored_turn or 0), component.start_vox


def view_of_site(site: Site, azimuth_deg: float | None = None, elevation_deg: float | None = None) -> View:
    """Return the view of the given angles.

    By default the yard is in front of the building and the mast behind, but not so straight behind that the jib over
    the building points to the eye and the crane hides everything.
    """
    view = View()
    elevation = view.elevation_deg if elevation_deg is None else elevation_deg
    if azimuth_deg is not None:
        return View(azimuth_deg, elevation)
    middle = building_centre_m(site)[:2]
    yard = np.argwhere(site.yard)
    if not len(yard):
        return View(view.azimuth_deg, elevation)
    yard_m = site.frame.corner_of(np.c_[yard + 0.5, np.zeros(len(yard))]).mean(axis=0)[:2]
    towards = yard_m - middle
    if np.linalg.norm(towards) < 0.1 * max(site.shape[:2]) * site.frame.voxel_size_m:
        return View(view.azimuth_deg, elevation)  # the yard surrounds the building
    angle = math.degrees(math.atan2(towards[1], towards[0]))
    mast_m = np.array(site.cranes[0].base_m[:2]) - middle if site.cranes else np.zeros(2)

    def nearness(azimuth: float) -> float:
        ahead_m = float(mast_m @ [math.cos(math.radians(azimuth)), math.sin(math.radians(azimuth))])
        return ahead_m if ahead_m > -math.cos(math.radians(_STRAIGHT_DEG)) * np.linalg.norm(mast_m) else math.inf

    return View(min((angle + _SIDE_DEG, angle - _SIDE_DEG), key=nearness), elevation)


# The picture of a voxelized building.

_FLOOR_SHARE = 0.12
"""Width of the floor around the building, as a share of its longer side."""


def scene_of_grid(grid: VoxelGrid, *, title: str = "") -> Scene:
    """Return the picture of a grid: components coloured by class, other parts gray.

    Without ground, a floor is added to receive the shadow.
    """
    # 0 empty, 1 floor, then parts.
    numbers = np.arange(1, len(grid.parts) + 2, dtype=index_type(len(grid.parts) + 2))
    numbers[0] = 0
    solids = grid.owners.mapped(numbers)
    counts = _components_by_class(grid)
    rgb_of_class = _rgb_by_class(counts)
    palette = np.concatenate([np.array([(0, 0, 0), colours.FLOOR], np.uint8), part_colours(grid)])
    cells = grid.counts()
    has_ground = bool(cells.get("ground"))
    frame, solids = (grid.frame, solids) if has_ground else _on_floor(grid.frame, solids)
    legend = [LegendEntry(f"{name} ({counts[name]})", rgb_of_class[name]) for name in rgb_of_class]
    rest = Counter(part.label for part in grid.parts if part.label is not Label.COMPONENT)
    if rest[Label.STRUCTURE]:
        legend.append(LegendEntry(f"not lifted ({rest[Label.STRUCTURE]})", colours.STRUCTURE))
    if rest[Label.GROUND]:
        legend.append(LegendEntry("ground", colours.GROUND))
    x, y, z = grid.shape
    filled = sum(cells.values()) - cells["air"]
    return Scene(
        frame=frame,
        solids=solids,
        palette=palette,
        legend=tuple(legend),
        title=title or str(grid.source.get("name", "")),
        caption=f"{counted(len(grid.parts), 'part')}, {x} x {y} x {z} cells of {grid.frame.voxel_size_m:g} m, "
        f"{filled:,} filled",
    )


def _on_floor(frame: GridFrame, solids: NDArray[np.unsignedinteger]) -> tuple[GridFrame, NDArray[np.unsignedinteger]]:
    """Return the solids on a slightly wider floor (number 1), one cell thick; empty solids are returned unchanged."""
    if not solids.any():
        return frame, solids
    margin = max(1, round(_FLOOR_SHARE * max(solids.shape[:2])))
    low = int(np.flatnonzero(solids.any(axis=(0, 1)))[0])
    padded = np.pad(solids[:, :, low:], ((margin, margin), (margin, margin), (1, 0)))
    padded[:, :, 0] = 1
    x, y, z = (float(n) for n in frame.corner_of(np.array([-margin, -margin, low - 1])))
    return GridFrame((x, y, z), frame.voxel_size_m), padded


def part_colours(grid: VoxelGrid) -> NDArray[np.uint8]:
    """Return the colour of every part, (P, 3) uint8 sRGB: components by class, other parts gray."""
    rgb_of_class = _rgb_by_class(_components_by_class(grid))
    colours = [_rgb_of(part, rgb_of_class) for part in grid.parts]
    return np.array(colours, np.uint8).reshape(-1, 3)


def _components_by_class(grid: VoxelGrid) -> Counter[str]:
    return Counter(part.ifc_class for part in grid.parts if part.label is Label.COMPONENT)


def _rgb_by_class(counts: Counter[str]) -> dict[str, Rgb]:
    return {name: colours.CLASSES[min(n, len(colours.CLASSES) - 1)] for n, (name, _) in enumerate(counts.most_common())}


def _rgb_of(part: Part, rgb_of_class: dict[str, Rgb]) -> Rgb:
    if part.label is Label.COMPONENT:
        return rgb_of_class[part.ifc_class]
    return colours.GROUND if part.label is Label.GROUND else colours.STRUCTURE
