"""The picture of a site: ground, areas, structure, obstructions, the cranes, the building as designed."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from bimvox.grid.frame import Label
from bimvox.planning.yard import storage_poses
from bimvox.records.lift import Lift
from bimvox.rendering.colours import (
    ACCESS,
    ASSEMBLED,
    CONSTRUCTION_AREA,
    GROUND,
    OBSTRUCTION,
    START_BOX,
    STRUCTURE,
    UNBUILT,
    YARD,
)
from bimvox.rendering.draw.camera import View
from bimvox.rendering.scene.cranes import building_centre_m, site_cranes
from bimvox.rendering.scene.lattice import CraneParts
from bimvox.rendering.scene.layers import Layer
from bimvox.rendering.scene.scene import Block, LegendEntry, Scene, Strokes, box_edges
from bimvox.rendering.scene.solids import Canvas
from bimvox.rendering.words import counted
from bimvox.site.component import Component, IntVec, Shape
from bimvox.site.shape import stored_shape
from bimvox.site.site import Site

_AREAS = (
    (Label.GROUND, GROUND, "ground"),
    (Label.CONSTRUCTION_AREA, CONSTRUCTION_AREA, "construction area"),
    (Label.YARD, YARD, "yard"),
)
_SIDE_DEG = 38.0
_STRAIGHT_DEG = 25.0


def scene_of_site(site: Site) -> Scene:
    """Return the picture of a site before planning, with the components at their targets."""
    canvas = site_canvas(site, len(site.components) * 2)
    legend = site_legend(site)
    strokes: list[Strokes] = []
    for component in site.components:
        canvas.paint(target_cells(component), ASSEMBLED, layer=Layer.ASSEMBLED)
    legend.append(LegendEntry(f"as designed ({len(site.components)})", ASSEMBLED, layer=Layer.ASSEMBLED))
    given = [component for component in site.components if component.start_vox is not None]
    for component in given:
        shape, cell = given_place(component)
        canvas.paint(shape.cells + np.array(cell), UNBUILT, layer=Layer.UNBUILT)
        strokes.append(boxes_strokes(site, [(shape, cell)], START_BOX))
    if given:
        legend.append(LegendEntry(f"in the yard ({len(given)})", UNBUILT, layer=Layer.UNBUILT))
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
        canvas.paint(site.blockers[0].cells, GROUND, layer=Layer.GROUND)
    for label, rgb, _ in _AREAS:
        canvas.paint_columns(slab == label, tops, rgb, layer=Layer.GROUND)
    # `Site.yard` defines the yard; the labels of the slab need not repeat it.
    canvas.paint_columns(site.yard & (slab == Label.GROUND), tops, YARD, layer=Layer.GROUND)
    if site.access is not None:
        canvas.paint_columns(site.access, tops, ACCESS, layer=Layer.GROUND)
    for blocker in site.blockers[1:]:
        above = blocker.cells[blocker.cells[:, 2] > tops[blocker.cells[:, 0], blocker.cells[:, 1]]]
        if blocker.kind == "structure" or (blocker.kind == "crane" and not site.cranes):
            canvas.paint(above, STRUCTURE, layer=Layer.STRUCTURE)
        elif blocker.kind == "obstruction":
            canvas.paint(above, OBSTRUCTION, over=True, layer=Layer.OBSTRUCTIONS)
    return canvas


def site_legend(site: Site) -> list[LegendEntry]:
    """Return the legend of a site's fixed solids."""
    slab = site.labels[:, :, 0]
    there = {label: bool((slab == label).any()) for label, _, _ in _AREAS}
    there[Label.YARD] = bool(site.yard.any())
    there[Label.GROUND] = bool(((slab == Label.GROUND) & ~site.yard).any())
    legend = [LegendEntry(name, rgb, layer=Layer.GROUND) for label, rgb, name in _AREAS if there[label]]
    if site.access is not None:
        legend.append(LegendEntry("access of trucks", ACCESS, layer=Layer.GROUND))
    kinds = {blocker.kind for blocker in site.blockers}
    if "structure" in kinds:
        legend.append(LegendEntry("existing structure", STRUCTURE, layer=Layer.STRUCTURE))
    if "obstruction" in kinds:
        legend.append(LegendEntry("obstruction", OBSTRUCTION, layer=Layer.OBSTRUCTIONS))
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


def given_place(component: Component) -> tuple[Shape, IntVec]:
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
